#pragma once
#include "app/devices/mock_drive.hpp"
#include "app/devices/rig_settings.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::test {

/// How a drive of the mock is taken down as a data set: paired as `vergence run --fast` pairs it,
/// every frame waited for, on its clock.
[[nodiscard]] inline Acquisition::Options mock_source_options(const app::Configuration& c,
                                                              const app::MockDrive& drive) {
  constexpr Stamp kVirtualEpoch{1'577'836'800'000'000'000};  // of vergence run --fast: 2020-01-01
  Acquisition::Options o;
  o.sync.cameras = 2;
  o.sync.interval = Duration::seconds(1 / c.trigger.rate);
  o.sync.hold = Duration::seconds(c.sync.hold_ms * 1e-3);
  o.wait_when_full = true;
  o.tie_stamp = kVirtualEpoch;
  o.tie_host = drive.rig->start();
  o.stamp_grid = app::stamp_grid(c);
  return o;
}

}  // namespace vergence::test
