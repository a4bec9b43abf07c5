#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"

namespace vergence::app {
namespace {

constexpr const char* kCpus = "/sys/devices/system/cpu/";

/// What systemd understands as a limit: a number, `infinity`, or both of `soft:hard`.
bool is_enough(const std::string& limit, int wanted) {
  if (limit.starts_with("infinity")) return true;
  int value = 0;
  (void)std::from_chars(limit.data(), limit.data() + limit.size(), value);
  return value >= wanted;
}

std::string for_this_user(const CheckContext& p) {
  return fmt::format(
      "printf '{0} - rtprio {1}\\n{0} - memlock unlimited\\n' | sudo tee "
      "/etc/security/limits.d/60-vergence.conf",
      p.machine.user, std::max(20, p.needs.realtime_priority));
}

/// The service drives, with limits of its own; what this user may counts for a drive by hand only.
Finding realtime_of_service(const CheckContext& p, bool by_hand) {
  const std::string limit = p.service_setting("LimitRTPRIO").value_or("0");
  Finding f{"realtime",
            by_hand ? FindingState::ok : FindingState::advice,
            fmt::format("threads ask for real-time priority {}; the service has LimitRTPRIO={}",
                        p.needs.realtime_priority, limit),
            {}};
  if (!is_enough(limit, p.needs.realtime_priority)) {
    f.state = FindingState::problem;
    f.mend = {"sudo mkdir -p /etc/systemd/system/vergence.service.d",
              fmt::format("printf '[Service]\\nLimitRTPRIO={}\\n' | sudo tee "
                          "/etc/systemd/system/vergence.service.d/realtime.conf && sudo systemctl "
                          "daemon-reload",
                          p.needs.realtime_priority)};
  } else if (!by_hand) {
    f.sentence += fmt::format("; by hand: {} may not give it", p.machine.user);
    f.mend = {for_this_user(p)};
  }
  return f;
}

void check_realtime(const CheckContext& p, std::vector<Finding>* findings) {
  if (p.needs.realtime_priority <= 0) return;
  constexpr unsigned kCapSysNice = 23;
  const auto limit = p.machine.limit("Max realtime priority");
  if (!limit) return;
  const bool may =
      *limit < 0 || *limit >= p.needs.realtime_priority || p.machine.has_capability(kCapSysNice);
  if (p.is_of_service()) {
    findings->push_back(realtime_of_service(p, may));
    return;
  }
  Finding f{"realtime",
            may ? FindingState::ok : FindingState::problem,
            fmt::format("threads ask for real-time priority {}, {} may give up to {}",
                        p.needs.realtime_priority, p.machine.user,
                        *limit < 0 ? "any" : std::to_string(*limit)),
            {}};
  if (!may) f.mend = {for_this_user(p)};
  findings->push_back(std::move(f));
}

void check_memory_lock(const CheckContext& p, std::vector<Finding>* findings) {
  if (!p.needs.lock_memory) return;
  constexpr unsigned kCapIpcLock = 14;
  const auto locked = p.machine.limit("Max locked memory");
  constexpr std::int64_t kEnough = std::int64_t{512}
                                   << 20;  // of two cameras, threads and libraries included
  const std::string service =
      p.is_of_service() ? " by hand, the service has LimitMEMLOCK=" +
                              p.service_setting("LimitMEMLOCK").value_or("8M, systemd's own")
                        : "";
  if (locked && *locked >= 0 && *locked < kEnough && !p.machine.has_capability(kCapIpcLock))
    findings->push_back(
        {"memory_lock",
         FindingState::advice,
         fmt::format("{} MiB of memory may be locked{}; realtime.lock_memory wants {} or more",
                     *locked >> 20, service, kEnough >> 20),
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

std::string nobody_sets_it(bool battery) {
  std::string s =
      "nothing sets this machine's clock: the dates of sessions may be wrong, their intervals are "
      "not";
  if (!battery)
    s += "; it has no clock with a battery, and every start begins with an old date: "
         "systemd-timesyncd remembers the last one, as fake-hwclock does beside chrony";
  return s;
}

/// Over a time without power, though no clock runs then.
bool remembers_the_date(const Machine& m) {
  return m.runs("systemd-timesyncd") || m.exists("/sbin/fake-hwclock") ||
         m.exists("/usr/sbin/fake-hwclock");
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
  const bool battery = p.machine.exists("/dev/rtc0");
  if (running.empty() && !known) {
    findings->push_back(
        {"clock",
         FindingState::advice,
         nobody_sets_it(battery),
         {battery ? "sudo apt-get install chrony" : "sudo apt-get install systemd-timesyncd"}});
    return;
  }
  if (!running.empty() && !battery && !remembers_the_date(p.machine)) {
    findings->push_back(
        {"clock",
         FindingState::advice,
         fmt::format("{} sets the clock, and the machine has none with a battery: sessions begin "
                     "with an old date until it is in step; fake-hwclock remembers the last one",
                     running.front()),
         {"sudo apt-get install fake-hwclock"}});
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

/// What keeps a drive from writing at all; empty: nothing.
std::vector<Finding> obstacles(const CheckContext& p, const DiskRoom& room,
                               const std::string& where) {
  constexpr std::uint64_t kLeastFiles = 100;  // a session makes some twenty, a recording more
  std::vector<Finding> all;
  const auto problem = [&](std::string sentence, std::vector<std::string> mend) {
    all.push_back({"disk", FindingState::problem, std::move(sentence), std::move(mend)});
  };
  if (room.read_only)
    problem(fmt::format("the file system of {} is read-only: no session can be written", where),
            {fmt::format("findmnt -T '{}'", p.out.string())});
  else if (!room.may_write && p.needs.given && !p.is_of_service())
    problem(fmt::format("{} may not write at {}: name a folder of your own by --out",
                        p.machine.user, where),
            {});
  if (room.files && *room.files < kLeastFiles)
    problem(fmt::format("{} files may still be made at {} (inodes), whatever room there is",
                        *room.files, where),
            {"df -i"});
  return all;
}

void check_disk(const CheckContext& p, std::vector<Finding>* findings) {
  const auto room = p.machine.room_at(p.out);
  if (!room) return;
  constexpr std::uint64_t kLeast = std::uint64_t{200} << 20, kComfortable = std::uint64_t{2} << 30;
  const double gigabytes = static_cast<double>(room->bytes) / 1e9;
  const std::string where = p.out == "." ? "the current folder" : p.out.string();
  if (auto some = obstacles(p, *room, where); !some.empty()) {
    findings->insert(findings->end(), some.begin(), some.end());
    return;
  }
  Finding f{
      "disk", FindingState::ok, fmt::format("{:.1f} GB are free at {}", gigabytes, where), {}};
  if (room->bytes < kComfortable) {
    f.state = room->bytes < kLeast ? FindingState::problem : FindingState::advice;
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
