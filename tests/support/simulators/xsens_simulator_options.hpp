#pragma once
#include <cstdint>
#include <vector>

#include "core/types/time.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::test {

struct XsensSimulatorOptions {
  xbus::Generation generation = xbus::Generation::mark4;
  std::uint32_t device_id = 0x07701234;
  std::uint32_t baud = 115200;                  // as stored in the device
  double clock_ppm = 20;                        // of its clock against the host's: positive is fast
  HostStamp power_on{};                         // and the drive's time 0
  Duration duration = Duration::seconds(3600);  // of the drive; nothing is sent after it
  Duration processing = Duration::milliseconds(2);          // from a sample to the first byte
  Duration processing_jitter = Duration::microseconds(50);  // above it
  std::uint32_t first_sample_time = 51'703'123;             // SampleTimeFine at power-on, 0.1 ms
  std::uint64_t sample_time_modulus = 864'000'000;          // a day; 2³² on other series
  std::uint16_t first_counter = 65'000;
  std::int64_t unix_ns_at_power_on = 1'577'836'800'000'000'000;
  Duration fix_interval = Duration::milliseconds(250);
  int fix_age = 5;  // samples that a receiver's message is older than the inertial one before it
  double missing_position =
      0;  // of the inertial messages: they come without latitude and longitude (MTi-G-700/710)
  std::vector<HostStamp> silences{};  // the sensor stops sending until it is told to measure again
  // Settings stored in the device; the simulator's own defaults when empty or zero.
  xbus::OutputConfiguration outputs{};
  xbus::MtdataLayout layout{0x0836, 0x001};
  std::uint16_t period = 1152;
  std::uint64_t seed = 1;
};

}  // namespace vergence::test
