#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/devices/rig_settings.hpp"
#include "core/types/stamped_pose.hpp"
#include "drivers/ins.hpp"
#include "drivers/mock/mock_rig.hpp"
#include "drivers/trigger.hpp"
#include "drivers/trigger_board/device.hpp"

/// From the configuration to the mock's rig. All of it throws InputError naming the key.
namespace vergence::app {

/// The mock's trigger board as a device that sends bytes: the reference firmware's state machine on
/// simulated hardware (`mock.board_line`) answers over a simulated serial line, the real driver
/// finds it, sets it and reads it, and its pulses trigger the mock's cameras.
///
/// Virtual time only, one of its own: Acquisition::Options::board_keeps_own_time. It begins a
/// little before the drive; pulses that are made before find nobody armed. The fault `board_gone`
/// unplugs the line (`powered=0` switches the board off with it), `board_reboot` restarts the
/// board; how long it is away is then up to the board and the driver. What asks for a pause gets it
/// at a pulse that differs from run to run: with `trigger.vary_us` nobody asks.
/// Ownership  The rig (with MockRigOptions::fed) outlives the device. *driver is the real driver
///            inside, for what it measures.
/// Errors     InputError as the driver's sentence. `remarks`: as open_ins().
[[nodiscard]] std::unique_ptr<TriggerDevice> make_simulated_board(
    const Configuration& configuration, mock::MockRig* rig, const trigger_board::Device** driver,
    std::vector<std::string>* remarks);

/// The mock's INS as a device that sends bytes: the simulator of an MTi-G or MTi-G-710
/// (`mock.ins_line`) measures the mock drive and streams over a simulated serial line with a USB
/// converter, and the real driver finds it, sets it and reads it.
///
/// Virtual time only: the line's clock is the rig's, and it begins a little before the drive, so
/// that there is time to find and set the device. The fault `ins_gone` unplugs the line.
/// Ownership  The rig outlives the device.
/// Errors     InputError as the driver's sentence. `remarks`: as open_ins().
[[nodiscard]] std::unique_ptr<InsDevice> make_simulated_ins(const Configuration& configuration,
                                                            const mock::MockRig& rig,
                                                            std::vector<std::string>* remarks);

/// Whether a drive with these devices is possible at all.
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

/// What the stamps of the drive are multiples of: with `mock.pattern: gbrg` whole microseconds,
/// which a St Lucia log can hold.
[[nodiscard]] Duration stamp_grid(const Configuration& configuration) noexcept;

/// The left camera's true pose in enu at every pulse's mid-exposure. `start`: the stamp of the
/// drive's time 0.
[[nodiscard]] std::vector<StampedPose> true_trajectory(const mock::MockRig& rig,
                                                       const Configuration& configuration,
                                                       Stamp start);

}  // namespace vergence::app
