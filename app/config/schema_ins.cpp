#include "app/config/detail/schema_groups.hpp"

namespace vergence::app::groups {

Group ins() {
  using I = InsSettings;
  return Rows<I>(
             "ins", "The inertial navigation system that the pose is compared with.",
             [](auto& c) -> auto& { return c.ins; })
      .text("driver", &I::driver, 16,
            "What talks to it: `xsens`, `nmea` or `ubx` (satellite receivers), `mock` (with mock "
            "cameras), or `none`.")
      .text("port", &I::port, 200,
            "Serial port of the INS, `/dev/ttyUSB0` or better a link that stays: "
            "`/dev/serial/by-id/…`. Empty: the only one on USB.")
      .integer("baud", &I::baud, 0, 2000000, "baud",
               "Rate of that line; the device is brought to it. 0: as the device has it, which is "
               "looked for.")
      .number("rate", &I::rate, 1, 400, "Hz",
              "Readings of the INS a second; an MTi-G-700/710 takes the nearest it has (100 for "
              "120). With "
              "`nmea` and `ubx` what the receiver sends.")
      .number("sync_out_hz", &I::sync_out_hz, -1, 400, "Hz",
              "Pulses a second at the INS's SyncOut; 0: as the device has it, -1: none. An "
              "MTi-G-700/710 makes 400 Hz / n, no 30.")
      .number("sync_out_width_ms", &I::sync_out_width_ms, 0.1, 100, "ms", "Length of such a pulse.")
      .number("processing_ms", &I::processing_ms, 0, 50, "ms",
              "From a sample to its first byte on the line, as the device's manual says; it goes "
              "into every stamp.")
      .numbers("lever_arm_m", &I::lever_arm_m, -100, 100, "m",
               {"Where the left camera sits in the INS's body: forward.",
                "The same place, to the left.", "The same place, upwards."})
      .numbers("boresight_deg", &I::boresight_deg, -180, 180, "°",
               {"How the rig's forward-left-up axes are turned against the INS's: roll.",
                "The same turn, its pitch.", "The same turn, its yaw."})
      .done();
}

Group comparison() {
  using C = ComparisonSettings;
  return Rows<C>(
             "comparison", "The comparison with the INS.",
             [](auto& c) -> auto& { return c.comparison; })
      .number("placement_m", &C::placement_m, 1, 100000, "m",
              "Distance driven with a valid fix after which the path is placed on the earth.")
      .number("correlation_s", &C::correlation_s, 0.1, 3600, "s",
              "For so long the INS's position errors resemble one another.")
      .number("heading_sigma_deg", &C::heading_sigma_deg, 0, 180, "°",
              "Of the INS's heading as the camera has it, mount included: so it weighs in the "
              "placement. 0: not at all, or with a mount "
              "published by a data set "
              "0.3°.")
      .number("max_gap_ms", &C::max_gap_ms, 1, 10000, "ms",
              "Readings farther apart than this are not interpolated between.")
      .number("max_wait_ms", &C::max_wait_ms, 1, 3000, "ms",
              "A pose waits so long for the reading after it.")
      .number("jump_m", &C::jump_m, 0.1, 1e6, "m",
              "A step of the INS's position beyond this (and 60 m/s) is a jump.")
      .number("scale_tolerance", &C::scale_tolerance, 0.001, 1, "",
              "Relative difference of the path lengths that is reported.")
      .done();
}

}  // namespace vergence::app::groups
