#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"

namespace vergence::app {
namespace {

constexpr const char* kCpus = "/sys/devices/system/cpu/";

void check_realtime(const CheckContext& p, std::vector<Finding>* findings) {
  if (p.needs.realtime_priority <= 0) return;
  constexpr unsigned kCapSysNice = 23;
  const auto limit = p.machine.limit("Max realtime priority");
  if (!limit) return;
  const bool may =
      *limit < 0 || *limit >= p.needs.realtime_priority || p.machine.has_capability(kCapSysNice);
  Finding f{"realtime",
            may ? FindingState::ok : FindingState::problem,
            fmt::format("threads ask for real-time priority {}, {} may give up to {}",
                        p.needs.realtime_priority, p.machine.user,
                        *limit < 0 ? "any" : std::to_string(*limit)),
            {}};
  if (!may)
    f.mend = {
        fmt::format("printf '{0} - rtprio {1}\\n{0} - memlock unlimited\\n' | sudo tee "
                    "/etc/security/limits.d/60-vergence.conf",
                    p.machine.user, std::max(20, p.needs.realtime_priority))};
  findings->push_back(std::move(f));
}

void check_memory_lock(const CheckContext& p, std::vector<Finding>* findings) {
  if (!p.needs.lock_memory) return;
  constexpr unsigned kCapIpcLock = 14;
  const auto locked = p.machine.limit("Max locked memory");
  constexpr std::int64_t kEnough = std::int64_t{512}
                                   << 20;  // of two cameras, threads and libraries included
  if (locked && *locked >= 0 && *locked < kEnough && !p.machine.has_capability(kCapIpcLock))
    findings->push_back(
        {"memory_lock",
         FindingState::advice,
         fmt::format("{} MiB of memory may be locked; realtime.lock_memory wants {} or more",
                     *locked >> 20, kEnough >> 20),
         {fmt::format(
             "echo '{} - memlock unlimited' | sudo tee -a /etc/security/limits.d/60-vergence.conf",
             p.machine.user)}});
}

void check_governor(const CheckContext& p, std::vector<Finding>* findings) {
  std::set<std::string> governors;
  bool adapts = true;  // drivers whose `powersave` goes up with the load
  for (const std::string& cpu : p.machine.names(kCpus)) {
    if (!cpu.starts_with("cpu") || cpu.size() < 4 ||
        cpu.find_first_not_of("0123456789", 3) != std::string::npos)
      continue;
    const auto governor = p.machine.line(std::string(kCpus) + cpu + "/cpufreq/scaling_governor");
    if (!governor || governor->empty()) continue;
    governors.insert(*governor);
    const std::string driver =
        p.machine.line(std::string(kCpus) + cpu + "/cpufreq/scaling_driver").value_or("");
    adapts = adapts && (driver == "intel_pstate" || driver.starts_with("amd-pstate"));
  }
  if (governors.empty()) return;
  const std::string list = fmt::format("{}", fmt::join(governors, ", "));
  const bool slow = governors.count("powersave") != 0 && !adapts;
  const bool lags = governors.count("ondemand") != 0 || governors.count("conservative") != 0;
  if (!slow && !lags) {
    findings->push_back(
        {"governor", FindingState::ok, fmt::format("the processors' governor is {}", list), {}});
    return;
  }
  findings->push_back(
      {"governor",
       FindingState::advice,
       fmt::format("the processors' governor is {}: {}; performance does not", list,
                   slow ? "it keeps them slow" : "it speeds them up only after images have waited"),
       {"echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
        "echo 'w /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor - - - - performance' | sudo "
        "tee "
        "/etc/tmpfiles.d/vergence-governor.conf"}});
}

void check_clock_source(const CheckContext& p, std::vector<Finding>* findings) {
  const auto source =
      p.machine.line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (!source || source->empty()) return;
  constexpr std::array kSlow{"hpet", "acpi_pm", "jiffies", "pit"};
  const bool slow = std::find(kSlow.begin(), kSlow.end(), *source) != kSlow.end();
  if (!slow) return;  // nothing anybody needs to know
  findings->push_back({"clock_source",
                       FindingState::advice,
                       fmt::format("the kernel reads its time from {}, some microseconds each: the "
                                   "processor's own counter was found "
                                   "unstable; look at the firmware's settings and at dmesg",
                                   *source),
                       {"cat /sys/devices/system/clocksource/clocksource0/available_clocksource",
                        "sudo dmesg | grep -i -e tsc -e clocksource"}});
}

void check_date(const CheckContext& p, std::vector<Finding>* findings) {
  constexpr std::array kDaemons{"chronyd", "systemd-timesyncd", "ntpd", "ntpd-rs"};
  std::vector<std::string> running;
  for (const char* name : kDaemons)
    if (p.machine.runs(name)) running.emplace_back(name);
  const bool known = p.machine.clock_synchronised.value_or(false);
  if (running.size() > 1) {
    findings->push_back({"clock",
                         FindingState::advice,
                         fmt::format("{} all set the clock: they pull it to and fro; keep one",
                                     fmt::join(running, ", ")),
                         {}});
    return;
  }
  if (running.empty() && !known) {
    findings->push_back({"clock",
                         FindingState::advice,
                         "nothing sets this machine's clock: the dates of sessions may be wrong, "
                         "their intervals are not",
                         {"sudo apt-get install chrony"}});
    return;
  }
  findings->push_back(
      {"clock",
       FindingState::ok,
       fmt::format(
           "{}, {}; stamps keep to the monotonic clock, whatever it does during a drive",
           running.empty() ? "the clock is set from outside" : running.front() + " sets the clock",
           known ? "which is in step" : "which is not in step yet"),
       {}});
}

void check_disk(const CheckContext& p, std::vector<Finding>* findings) {
  const auto free = p.machine.free_bytes(p.out);
  if (!free) return;
  constexpr std::uint64_t kLeast = std::uint64_t{200} << 20, kComfortable = std::uint64_t{2} << 30;
  const double gigabytes = static_cast<double>(*free) / 1e9;
  const std::string where = p.out == "." ? "the current folder" : p.out.string();
  Finding f{
      "disk", FindingState::ok, fmt::format("{:.1f} GB are free at {}", gigabytes, where), {}};
  if (*free < kComfortable) {
    f.state = *free < kLeast ? FindingState::problem : FindingState::advice;
    f.sentence += "; an hour's drive writes some 100 MB, recordings of images far more";
    f.mend = {"df -h"};
  }
  findings->push_back(std::move(f));
}

}  // namespace

void check_system(const CheckContext& p, std::vector<Finding>* findings) {
  check_realtime(p, findings);
  check_memory_lock(p, findings);
  check_governor(p, findings);
  check_clock_source(p, findings);
  check_date(p, findings);
  check_disk(p, findings);
}

}  // namespace vergence::app
