#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "drivers/ins.hpp"
#include "drivers/mock/mock_rig.hpp"

namespace vergence::app {

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

}  // namespace vergence::app
