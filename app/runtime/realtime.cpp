#include "app/runtime/realtime.hpp"

#include <linux/capability.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
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
    // Threads that render or read images in place of cameras have no priority.
    {"vergence-mock", ThreadRole::other},
    {"vergence-decode", ThreadRole::other},
    {"vergence-right", ThreadRole::other},
}};

/// Returns true if RLIMIT_MEMLOCK limits this program.
bool memory_limited() noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY) return false;
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  if (::syscall(SYS_capget, &header, data.data()) != 0) return true;
  return (data[0].effective & (1U << CAP_IPC_LOCK)) == 0;
}

/// Takes a number from the front of the text; false: there is none, or no such processor.
bool parse_number(std::string_view* text, int* number) noexcept {
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), *number);
  if (error != std::errc() || *number < 0 || *number >= CPU_SETSIZE) return false;
  text->remove_prefix(static_cast<std::size_t>(end - text->data()));
  return true;
}

bool skip_character(std::string_view* text, char c) noexcept {
  if (!text->starts_with(c)) return false;
  text->remove_prefix(1);
  return true;
}

ThreadRole thread_role(std::string_view name) noexcept {
  const auto* row = std::ranges::find_if(kRoles, [name](const auto& r) { return r.first == name; });
  if (row != kRoles.end()) return row->second;
  return name.starts_with("vergence-") && name != "vergence-mockio" ? ThreadRole::background
                                                                    : ThreadRole::other;
}

/// SCHED_FIFO priority of a role if the most urgent one has `top`; 0 means SCHED_OTHER.
int role_priority(ThreadRole role, int top) noexcept {
  if (top <= 0 || role == ThreadRole::solver || role == ThreadRole::other) return 0;
  return std::max(1, top - static_cast<int>(role));
}

}  // namespace

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
  if (settings_.lock_memory == 0) return {};
  RealtimeSystem::Locked locked = RealtimeSystem::Locked::everything;
  if (const int error = system_.lock_memory(&locked); error != 0)
    return {
        fmt::format("realtime.lock_memory is refused ({}); the run continues without it; allow it "
                    "with `ulimit -l unlimited`, in a service with LimitMEMLOCK=infinity",
                    std::strerror(error))};
  if (locked == RealtimeSystem::Locked::present)
    return {
        "realtime.lock_memory: present memory is locked, but the limit prevents locking later "
        "allocations; raise it with `ulimit -l unlimited`, in a service with "
        "LimitMEMLOCK=infinity"};
  return {};
}

std::vector<std::string> RealtimeThreads::apply(const std::vector<ProcessThread>& threads) {
  std::vector<std::string> messages;
  if (settings_.priority <= 0 && !affinity_ && !solver_affinity_) return messages;
  // One that has ended is forgotten: capture threads come and go for months, and a number is given
  // again.
  std::erase_if(done_, [&](const auto& done) {
    return std::ranges::none_of(
        threads, [&](const ProcessThread& thread) { return thread.id == done.first; });
  });
  for (const ProcessThread& thread : threads) {
    const ThreadRole role = thread_role(thread.name);
    // The thread may not have set its name yet.
    if (role == ThreadRole::other) continue;
    const auto [at, is_new] = done_.try_emplace(thread.id, role);
    if (!is_new && at->second == role) continue;
    // The kernel reuses the id of a thread that has ended.
    at->second = role;
    apply(thread, &messages);
  }
  return messages;
}

void RealtimeThreads::apply(const ProcessThread& thread, std::vector<std::string>* messages) {
  const ThreadRole role = thread_role(thread.name);
  const bool solver = role == ThreadRole::solver;
  if (const auto& cpus = solver ? solver_affinity_ : affinity_; cpus)
    set_affinity(thread.id, *cpus, solver, messages);
  const int priority = role_priority(role, settings_.priority);
  if (priority == 0) return;
  const int error = system_.set_fifo(thread.id, priority);
  if (error == 0 || error == ESRCH || std::exchange(priority_refused_, true)) return;
  messages->push_back(
      fmt::format("realtime.priority: {} is refused priority {} ({}); the run continues without "
                  "it; allow it with `sudo setcap cap_sys_nice,cap_ipc_lock+ep $(command -v "
                  "vergence)`, in a service with LimitRTPRIO={}",
                  thread.name, priority, std::strerror(error), settings_.priority));
}

void RealtimeThreads::set_affinity(pid_t thread, const cpu_set_t& cpus, bool solver,
                                   std::vector<std::string>* messages) {
  const int error = system_.set_affinity(thread, cpus);
  bool& refused = solver ? solver_affinity_refused_ : affinity_refused_;
  if (error == 0 || error == ESRCH || std::exchange(refused, true)) return;
  messages->push_back(
      fmt::format("realtime.{}: none of these processors is available ({}); the run continues on "
                  "all; `taskset -pc $$` lists the available ones",
                  solver ? "solver_affinity" : "affinity", std::strerror(error)));
}

std::optional<cpu_set_t> parse_cpu_list(std::string_view text) noexcept {
  cpu_set_t set;
  CPU_ZERO(&set);
  do {
    int first = 0;
    if (!parse_number(&text, &first)) return std::nullopt;
    int last = first;
    if (skip_character(&text, '-') && (!parse_number(&text, &last) || last < first))
      return std::nullopt;
    for (int cpu = first; cpu <= last; ++cpu) CPU_SET(static_cast<unsigned>(cpu), &set);
  } while (skip_character(&text, ','));
  if (!text.empty()) return std::nullopt;
  return set;
}

void process_threads(std::vector<ProcessThread>* threads) {
  threads->clear();
  std::error_code error;
  for (std::filesystem::directory_iterator task("/proc/self/task", error), end;
       !error && task != end; task.increment(error)) {
    std::ifstream comm(task->path() / "comm");
    std::string name;
    // It may not be there any more.
    if (std::getline(comm, name))
      threads->push_back({static_cast<pid_t>(std::stol(task->path().filename().string())), name});
  }
}

}  // namespace vergence::app
