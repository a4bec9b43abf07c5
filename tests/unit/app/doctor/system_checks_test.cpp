#include "app/doctor/checks.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/app/doctor/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::contains;
using test::FakeMachine;
using test::mends_with;

TEST(DoctorSystem, aGovernorThatKeepsProcessorsSlowIsTold) {
  FakeMachine f;
  f.file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
  f.file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_driver", "intel_pstate\n");
  EXPECT_EQ(f.of("governor")[0].state, FindingState::ok) << "there powersave goes with the load";
  f.file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_driver", "acpi-cpufreq\n");
  EXPECT_EQ(f.of("governor")[0].state, FindingState::advice);
  f.file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  EXPECT_EQ(f.of("governor")[0].state, FindingState::ok);
}

TEST(DoctorSystem, realTimeLimitsMatterWhenThreadsAskForThem) {
  FakeMachine f;
  f.file("/proc/self/limits",
         "Max realtime priority     0                    0\nMax locked memory         8388608    "
         "8388608   bytes\n");
  EXPECT_TRUE(f.of("realtime").empty());
  f.needs.realtime_priority = 50;
  EXPECT_EQ(f.of("realtime")[0].state, FindingState::problem);
  EXPECT_TRUE(mends_with(f.of("realtime")[0], "driver - rtprio 50"));
  EXPECT_TRUE(f.of("memory_lock").empty());
  f.needs.lock_memory = true;
  EXPECT_EQ(f.of("memory_lock")[0].state, FindingState::advice);
}

TEST(DoctorSystem, clocksAreTold) {
  FakeMachine f;
  f.file("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  EXPECT_TRUE(f.of("clock_source").empty());
  f.file("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  EXPECT_EQ(f.of("clock_source")[0].state, FindingState::advice);
  f.machine.clock_synchronised = false;
  EXPECT_EQ(f.of("clock")[0].state, FindingState::advice);
  f.file("/dev/rtc0", "");
  f.file("/proc/5/comm", "chronyd\n");
  EXPECT_EQ(f.of("clock")[0].state, FindingState::ok);
  f.file("/proc/6/comm", "systemd-timesyn\n");
  EXPECT_TRUE(contains(f.of("clock")[0].sentence, "keep one"));
}

TEST(DoctorSystem, withoutABatteryTheDateHasToBeRemembered) {
  FakeMachine f;
  f.machine.clock_synchronised = false;
  EXPECT_EQ(f.of("clock")[0].mend[0], "sudo apt-get install systemd-timesyncd");
  EXPECT_TRUE(contains(f.of("clock")[0].sentence, "fake-hwclock"));
  f.file("/proc/5/comm", "chronyd\n");
  EXPECT_EQ(f.of("clock")[0].state, FindingState::advice);
  EXPECT_EQ(f.of("clock")[0].mend[0], "sudo apt-get install fake-hwclock");
  f.file("/sbin/fake-hwclock", "");
  EXPECT_EQ(f.of("clock")[0].state, FindingState::ok);
  FakeMachine with_battery;
  with_battery.file("/dev/rtc0", "");
  with_battery.machine.clock_synchronised = false;
  EXPECT_EQ(with_battery.of("clock")[0].mend[0], "sudo apt-get install chrony");
}

TEST(DoctorSystem, theServiceDrivesWithItsOwnLimits) {
  FakeMachine f;
  f.file("/proc/self/limits",
         "Max realtime priority     0                    0\nMax locked memory         8388608    "
         "8388608   bytes\n");
  f.needs.realtime_priority = 50;
  f.needs.lock_memory = true;
  f.configuration = "/etc/vergence/rig.yaml";
  EXPECT_EQ(f.of("realtime")[0].state, FindingState::problem) << "no service is installed";
  f.file("/usr/lib/systemd/system/vergence.service",
         test::read_file(VERGENCE_SOURCE_DIR "/packaging/vergence.service"));
  const Finding by_hand = f.of("realtime")[0];
  EXPECT_EQ(by_hand.state, FindingState::advice);
  EXPECT_TRUE(contains(by_hand.sentence, "the service has LimitRTPRIO=90; by hand: driver may not"))
      << by_hand.sentence;
  EXPECT_TRUE(contains(f.of("memory_lock")[0].sentence, "the service has LimitMEMLOCK=infinity"));
  f.needs.realtime_priority = 95;
  EXPECT_EQ(f.of("realtime")[0].state, FindingState::problem);
  EXPECT_TRUE(mends_with(f.of("realtime")[0], "LimitRTPRIO=95"));
  f.file("/etc/systemd/system/vergence.service.d/realtime.conf", "[Service]\nLimitRTPRIO=95\n");
  EXPECT_EQ(f.of("realtime")[0].state, FindingState::advice);
  f.configuration = "rig.yaml";
  EXPECT_EQ(f.of("realtime")[0].state, FindingState::problem);
}

TEST(DoctorSystem, theDiskNeedsRoom) {
  FakeMachine f;
  f.room->bytes = std::uint64_t{1} << 30;
  EXPECT_EQ(f.of("disk")[0].state, FindingState::advice);
  f.room->bytes = 1000;
  EXPECT_EQ(f.of("disk")[0].state, FindingState::problem);
  f.room.reset();
  EXPECT_TRUE(f.of("disk").empty());
}

TEST(DoctorSystem, aReadOnlyDiskTakesNoSession) {
  FakeMachine f;
  f.room->read_only = true;
  ASSERT_EQ(f.of("disk").size(), 1U);
  EXPECT_EQ(f.of("disk")[0].state, FindingState::problem);
  EXPECT_TRUE(contains(f.of("disk")[0].sentence, "read-only"));
}

TEST(DoctorSystem, aDiskWithoutInodesTakesNoSession) {
  FakeMachine f;
  f.room->files = 0;
  ASSERT_EQ(f.of("disk").size(), 1U);
  EXPECT_EQ(f.of("disk")[0].state, FindingState::problem);
  f.room->files.reset();
  EXPECT_EQ(f.of("disk")[0].state, FindingState::ok) << "a file system without inodes";
}

TEST(DoctorSystem, whoDrivesHasToBeAllowedToWrite) {
  FakeMachine f;
  f.room->may_write = false;
  EXPECT_EQ(f.of("disk")[0].state, FindingState::ok) << "no drive is planned";
  f.needs.given = true;
  EXPECT_EQ(f.of("disk")[0].state, FindingState::problem);
  f.configuration = "/etc/vergence/rig.yaml";
  f.file("/usr/lib/systemd/system/vergence.service", "[Service]\n");
  EXPECT_EQ(f.of("disk")[0].state, FindingState::ok) << "the service writes there";
}

}  // namespace
}  // namespace vergence::app
