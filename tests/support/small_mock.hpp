#pragma once
#include <string>

#include "drivers/mock/mock_rig.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::test {

/// A town of roads alone.
[[nodiscard]] inline std::shared_ptr<const mock::World> empty_town() {
  static const auto town = [] {
    mock::WorldOptions o{
        .texture_detail = 0, .built_fraction = 0, .car_fraction = 0, .tree_fraction = 0};
    return std::make_shared<const mock::World>(o);
  }();
  return town;
}

/// Tiny pictures of an almost empty town: for tests of what devices do, not of what is seen.
[[nodiscard]] inline std::shared_ptr<const mock::RigTruth> small_truth(
    const std::vector<std::string>& faults = {}, int cameras = 2,
    mock::DriveKind kind = mock::DriveKind::brief) {
  std::vector<mock::Fault> parsed;
  for (const std::string& f : faults) parsed.push_back(mock::parse_fault(f));
  mock::DriveOptions drive{.kind = kind};
  return std::make_shared<const mock::RigTruth>(
      empty_town(), drive, parallel_rig(pinhole(64, 48, 50), 0.75, cameras),
      mock::default_T_body_left(), Transform{}, std::move(parsed));
}

/// Configuration of its cameras: triggered, 8 ms.
[[nodiscard]] inline CameraConfiguration small_camera(double rate_hz = 20) {
  return {64, 48, rate_hz, Duration::milliseconds(8), 0, CameraTrigger::hardware};
}

}  // namespace vergence::test
