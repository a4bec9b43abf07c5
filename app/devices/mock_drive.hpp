#pragma once
#include <memory>

#include "app/config/configuration.hpp"
#include "core/types/stamped_pose.hpp"
#include "drivers/mock/mock_rig.hpp"

/// Makes the simulated rig from the configuration. All functions throw InputError with the key.
namespace vergence::app {

/// Checks that a run with these devices is possible.
void check_drive(const Configuration& configuration);

/// Makes world, trajectory and devices, configured and ready to start; the INS only if its driver
/// is `mock`. Adds `faults` to the configuration's.
[[nodiscard]] std::unique_ptr<mock::MockRig> make_mock_drive(const Configuration& configuration,
                                                             const std::vector<std::string>& faults,
                                                             bool real_time,
                                                             std::optional<double> duration_s);

/// Resolution of the session's stamps: with `mock.pattern: gbrg` whole microseconds, the resolution
/// of a St Lucia log.
[[nodiscard]] Duration stamp_grid(const Configuration& configuration) noexcept;

/// True poses of the left camera in enu at every pulse's mid-exposure. `start` is the stamp of the
/// drive's time 0.
[[nodiscard]] std::vector<StampedPose> true_trajectory(const mock::MockRig& rig,
                                                       const Configuration& configuration,
                                                       Stamp start);

}  // namespace vergence::app
