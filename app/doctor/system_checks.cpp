#include <linux/capability.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"

namespace vergence::app {
namespace {

/// Limits of this process, where threads or memory ask for them.
void check_limits(const CheckContext& p, std::vector<Finding>* findings) {
  constexpr std::int64_t kLockedMemory = std::int64_t{512} << 20;  // of two cameras and threads
  struct Limit {
    const char* check;
    const char* key;
    const char* name;  // in /proc/self/limits
    unsigned capability;
    std::int64_t wanted;  // 0: not asked for
    FindingState refused;
    std::string item;
  };
  const int priority = p.needs.realtime_priority;
  const std::array limits{
      Limit{"realtime", "realtime.priority", "Max realtime priority", CAP_SYS_NICE, priority,
            FindingState::problem, fmt::format("rtprio {}", std::max(20, priority))},
      Limit{"memory_lock", "realtime.lock_memory", "Max locked memory", CAP_IPC_LOCK,
            p.needs.lock_memory ? kLockedMemory : 0, FindingState::advice, "memlock unlimited"}};
  for (const Limit& l : limits) {
    const auto limit = p.machine.limit(l.name);
    if (l.wanted <= 0 || !limit) continue;
    const bool enough = *limit < 0 || *limit >= l.wanted || p.machine.has_capability(l.capability);
    Finding f{l.check,
              FindingState::ok,
              fmt::format("{} needs a limit of {}, {} has {}", l.key, l.wanted, p.machine.user,
                          *limit < 0 ? "none" : std::to_string(*limit)),
              {}};
    if (!enough) {
      f.state = l.refused;
      f.mend = {fmt::format("echo '{} - {}' | sudo tee -a /etc/security/limits.d/60-vergence.conf",
                            p.machine.user, l.item)};
    }
    findings->push_back(std::move(f));
  }
}

void check_clock(const CheckContext& p, std::vector<Finding>* findings) {
  Finding f{"clock", FindingState::ok, "the clock is in step", {}};
  if (!p.machine.clock_synchronised.value_or(false)) {
    f.state = FindingState::advice;
    f.message =
        "the clock is not in step: the dates of sessions may be wrong, their intervals are not";
    // Without a clock with a battery a start begins with an old date; timesyncd remembers the last.
    f.mend = {p.machine.exists("/dev/rtc0") ? "sudo apt-get install chrony"
                                            : "sudo apt-get install systemd-timesyncd"};
  }
  findings->push_back(std::move(f));
}

void check_disk(const CheckContext& p, std::vector<Finding>* findings) {
  constexpr std::uint64_t kMin = std::uint64_t{200} << 20, kComfortable = std::uint64_t{2} << 30;
  const auto room = p.machine.room_at(p.out);
  if (!room) return;
  const std::string where = p.out == "." ? "the current folder" : p.out.string();
  Finding f{"disk",
            FindingState::ok,
            fmt::format("{:.1f} GB are free at {}", static_cast<double>(room->bytes) / 1e9, where),
            {}};
  if (room->read_only) {
    f.state = FindingState::problem;
    f.message = fmt::format("the file system of {} is read-only: no session can be written", where);
    f.mend = {fmt::format("findmnt -T '{}'", p.out.string())};
  } else if (!room->may_write && p.needs.given) {
    f.state = FindingState::problem;
    f.message = fmt::format("{} may not write at {}: name a folder of your own by --out",
                            p.machine.user, where);
  } else if (room->bytes < kComfortable) {
    f.state = room->bytes < kMin ? FindingState::problem : FindingState::advice;
    f.message += "; an hour's drive writes some 100 MB, recordings of images far more";
    f.mend = {"df -h"};
  }
  findings->push_back(std::move(f));
}

}  // namespace

void check_system(const CheckContext& p, std::vector<Finding>* findings) {
  check_limits(p, findings);
  check_clock(p, findings);
  check_disk(p, findings);
}

}  // namespace vergence::app
