#pragma once
#include <vector>

#include "core/types/time.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::test {

struct XsensSimulatorOptions {
  xbus::Generation generation = xbus::Generation::mark4;
  std::uint32_t device_id = 0x07701234;
  /// As stored in the device.
  std::uint32_t baud = 115200;
  /// Error of its clock against the host's: positive is fast.
  double clock_ppm = 20;
  /// Time 0 of the drive, too.
  HostStamp power_on{};
  /// Length of the drive; nothing is sent after it.
  Duration duration = Duration::seconds(3600);
  /// From a sample to the first byte.
  Duration processing = Duration::milliseconds(2);
  /// Above `processing`.
  Duration processing_jitter = Duration::microseconds(50);
  /// SampleTimeFine at power-on, 0.1 ms.
  std::uint32_t first_sample_time = 51'703'123;
  /// A day; 2³² on other series.
  std::uint64_t sample_time_modulus = 864'000'000;
  std::uint16_t first_counter = 65'000;
  std::int64_t unix_ns_at_power_on = 1'577'836'800'000'000'000;
  Duration fix_interval = Duration::milliseconds(250);
  /// Samples that a receiver's message is older than the inertial one before it.
  int fix_age = 5;
  /// Share of the inertial messages that come without latitude and longitude (MTi-G-700/710).
  double missing_position = 0;
  /// The sensor stops sending until it is commanded to measure again.
  std::vector<HostStamp> silences{};
  // Settings stored in the device; the simulator's own defaults when empty or zero.
  xbus::OutputConfiguration outputs{};
  xbus::MtdataLayout layout{0x0836, 0x001};
  std::uint16_t period = 1152;
  std::uint64_t seed = 1;
};

}  // namespace vergence::test
