#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "core/types/stamped_pose.hpp"
#include "drivers/mock/mock_rig.hpp"

/// From the configuration to the mock's rig. All of it throws InputError naming the key.
namespace vergence::app {

/// Checks that a run with these devices is possible.
void check_drive(const Configuration& configuration);

struct MockDrive {
  std::unique_ptr<mock::MockRig> rig;
  bool has_ins = false;
};
/// World, drive and devices, configured and ready to start. `faults` are added to the
/// configuration's. `raw`: cameras of a Bayer pattern hand out the mosaic itself.
[[nodiscard]] MockDrive make_mock_drive(const Configuration& configuration,
                                        const std::vector<std::string>& faults, bool real_time,
                                        std::optional<double> duration_s, bool raw = false);

/// Resolution of the session's stamps: with `mock.pattern: gbrg` whole microseconds,
/// which a St Lucia log can hold.
[[nodiscard]] Duration stamp_grid(const Configuration& configuration) noexcept;

/// The left camera's true pose in enu at every pulse's mid-exposure. `start`: the stamp of the
/// drive's time 0.
[[nodiscard]] std::vector<StampedPose> true_trajectory(const mock::MockRig& rig,
                                                       const Configuration& configuration,
                                                       Stamp start);

}  // namespace vergence::app
