#include "app/runtime/realtime.hpp"

#include <linux/capability.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <dirent.h>
#include <fcntl.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr std::array<std::pair<std::string_view, ThreadRole>, 14> kRoles{{
    {"vergence-gige", ThreadRole::capture},
    {"vergence-v4l2", ThreadRole::capture},
    {"vergence-iidc13", ThreadRole::capture},
    {"vergence-iidcus", ThreadRole::capture},
    {"vergence-board", ThreadRole::capture},
    {"vergence-pace", ThreadRole::capture},
    {"vergence-sync", ThreadRole::capture},
    {"vergence-estim", ThreadRole::estimator},
    {"vergence-front", ThreadRole::estimator},
    {"vergence-ins", ThreadRole::ins},
    {"vergence-calib", ThreadRole::solver},
    // What renders a drive instead of cameras, or reads one instead of them, is no part of it.
    {"vergence-mock", ThreadRole::other},
    {"vergence-decode", ThreadRole::other},
    {"vergence-right", ThreadRole::other},
}};

/// Whether RLIMIT_MEMLOCK binds this program.
bool memory_limited() noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY) return false;
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  if (::syscall(SYS_capget, &header, data.data()) != 0) return true;
  return (data[0].effective & (1U << CAP_IPC_LOCK)) == 0;
}

std::string reason(int error) { return std::strerror(error); }

}  // namespace

ThreadRole thread_role(std::string_view name) noexcept {
  const auto* row =
      std::find_if(kRoles.begin(), kRoles.end(), [name](const auto& r) { return r.first == name; });
  if (row != kRoles.end()) return row->second;
  return name.starts_with("vergence-") && name != "vergence-mockio" ? ThreadRole::background
                                                                    : ThreadRole::other;
}

int role_priority(ThreadRole role, int top) noexcept {
  if (top <= 0 || role == ThreadRole::solver || role == ThreadRole::other) return 0;
  const int below = role == ThreadRole::capture     ? 0
                    : role == ThreadRole::estimator ? 1
                    : role == ThreadRole::ins       ? 2
                                                    : 3;
  return std::max(1, top - below);
}

int RealtimeSystem::set_fifo(pid_t thread, int priority) {
  sched_param parameter{};
  parameter.sched_priority = priority;
  return ::sched_setscheduler(thread, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) == 0 ? 0
                                                                                         : errno;
}

int RealtimeSystem::set_affinity(pid_t thread, const cpu_set_t& cpus) {
  return ::sched_setaffinity(thread, sizeof(cpus), &cpus) == 0 ? 0 : errno;
}

int RealtimeSystem::lock_memory(Locked* locked) {
  *locked = Locked::present;
  if (::mlockall(MCL_CURRENT) != 0) return errno;
  // Under a limit an allocation beyond it would fail in the middle of a drive.
  if (memory_limited()) return 0;
  if (::mlockall(MCL_FUTURE | MCL_ONFAULT) == 0) *locked = Locked::everything;
  return 0;
}

std::vector<std::string> RealtimeThreads::lock_memory() {
  if (!request_.lock_memory) return {};
  RealtimeSystem::Locked locked = RealtimeSystem::Locked::everything;
  if (const int error = system_.lock_memory(&locked); error != 0)
    return {fmt::format(
        "realtime.lock_memory is refused ({}), the drive goes on without: allow it with `ulimit -l "
        "unlimited`, in a service with LimitMEMLOCK=infinity",
        reason(error))};
  if (locked == RealtimeSystem::Locked::present)
    return {
        "realtime.lock_memory: what there is now is locked, memory taken later is not, under "
        "the limit that is set: lift it with `ulimit -l unlimited`, in a service with "
        "LimitMEMLOCK=infinity"};
  return {};
}

std::vector<std::string> RealtimeThreads::apply(const std::vector<ProcessThread>& threads) {
  std::vector<std::string> sentences;
  if (request_.priority <= 0 && !request_.affinity && !request_.solver_affinity) return sentences;
  // One that has ended is forgotten: capture threads come and go for months, and a number is given
  // again.
  std::erase_if(done_, [&](const auto& done) {
    return std::none_of(threads.begin(), threads.end(),
                        [&](const ProcessThread& thread) { return thread.id == done.first; });
  });
  for (const ProcessThread& thread : threads) {
    const ThreadRole role = thread_role(thread.name);
    if (role == ThreadRole::other) continue;  // it may still be about to get its name
    const auto [at, is_new] = done_.try_emplace(thread.id, role);
    if (!is_new && at->second == role) continue;
    at->second = role;  // the number of a thread that has ended is given again
    apply(thread, &sentences);
  }
  return sentences;
}

void RealtimeThreads::apply(const ProcessThread& thread, std::vector<std::string>* sentences) {
  const ThreadRole role = thread_role(thread.name);
  const bool solver = role == ThreadRole::solver;
  if (const auto& cpus = solver ? request_.solver_affinity : request_.affinity; cpus)
    set_affinity(thread.id, *cpus, solver, sentences);
  const int priority = role_priority(role, request_.priority);
  if (priority == 0) return;
  const int error = system_.set_fifo(thread.id, priority);
  if (error == 0 || error == ESRCH || std::exchange(priority_refused_, true)) return;
  sentences->push_back(fmt::format(
      "realtime.priority: {} gets no priority {} ({}), the drive goes on without: allow it with "
      "`sudo setcap cap_sys_nice,cap_ipc_lock+ep $(command -v vergence)`, in a service with "
      "LimitRTPRIO={}",
      thread.name, priority, reason(error), request_.priority));
}

void RealtimeThreads::set_affinity(pid_t thread, const cpu_set_t& cpus, bool solver,
                                   std::vector<std::string>* sentences) {
  const int error = system_.set_affinity(thread, cpus);
  bool& refused = solver ? solver_affinity_refused_ : affinity_refused_;
  if (error == 0 || error == ESRCH || std::exchange(refused, true)) return;
  sentences->push_back(
      fmt::format("realtime.{}: there is none of these processors for us ({}), the drive goes on "
                  "on all of them: `taskset -pc $$` lists those that there are",
                  solver ? "solver_affinity" : "affinity", reason(error)));
}

namespace {

/// Takes a number from the front of the text; false: there is none, or no such processor.
bool take_number(std::string_view* text, int* number) noexcept {
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), *number);
  if (error != std::errc() || *number < 0 || *number >= CPU_SETSIZE) return false;
  text->remove_prefix(static_cast<std::size_t>(end - text->data()));
  return true;
}

bool take(std::string_view* text, char c) noexcept {
  if (!text->starts_with(c)) return false;
  text->remove_prefix(1);
  return true;
}

}  // namespace

std::optional<cpu_set_t> parse_cpu_list(std::string_view text) noexcept {
  cpu_set_t set;
  CPU_ZERO(&set);
  do {
    int first = 0;
    if (!take_number(&text, &first)) return std::nullopt;
    int last = first;
    if (take(&text, '-') && (!take_number(&text, &last) || last < first)) return std::nullopt;
    for (int cpu = first; cpu <= last; ++cpu) CPU_SET(static_cast<unsigned>(cpu), &set);
  } while (take(&text, ','));
  if (!text.empty()) return std::nullopt;
  return set;
}

namespace {

/// The kernel's directory entry (getdents64(2)), which opendir() would want heap for.
struct Entry {
  std::uint64_t inode;
  std::int64_t offset;
  std::uint16_t size;  // of the whole entry
  std::uint8_t type;
  char name[1];
};

/// A file's first line; empty: it is not there any more.
std::string_view first_line(const char* path, std::array<char, 64>* buffer) noexcept {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  const ssize_t got = ::read(file, buffer->data(), buffer->size());
  (void)::close(file);
  const std::string_view text(buffer->data(), got > 0 ? static_cast<std::size_t>(got) : 0);
  return text.substr(0, text.find('\n'));
}

void add_thread(const char* id, std::vector<ProcessThread>* threads) {
  const int number = static_cast<int>(std::strtol(id, nullptr, 10));  // 0: `.` and `..`
  if (number <= 0) return;
  std::array<char, 64> path{}, text{};
  (void)std::snprintf(path.data(), path.size(), "/proc/self/task/%d/comm", number);
  const std::string_view name = first_line(path.data(), &text);
  if (!name.empty()) threads->push_back({static_cast<pid_t>(number), std::string(name)});
}

}  // namespace

void process_threads(std::vector<ProcessThread>* threads) {
  threads->clear();
  const int folder = ::open("/proc/self/task", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  alignas(Entry) std::array<char, 4096> buffer;
  for (;;) {
    const long got = ::syscall(SYS_getdents64, folder, buffer.data(), buffer.size());
    if (got <= 0) break;
    for (std::size_t at = 0; at < static_cast<std::size_t>(got);) {
      std::uint16_t size = 0;
      std::memcpy(&size, buffer.data() + at + offsetof(Entry, size), sizeof size);
      add_thread(buffer.data() + at + offsetof(Entry, name), threads);
      at += std::max<std::size_t>(size, 1);
    }
  }
  (void)::close(folder);
}

}  // namespace vergence::app
