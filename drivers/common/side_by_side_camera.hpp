#pragma once
#include <memory>
#include <utility>

#include "drivers/camera.hpp"

namespace vergence {

/// Two cameras of one that gives both images in one picture, the left image's columns first, as
/// stereo cameras on USB and camera boards on CSI do.
///
///     auto [left, right] = split_side_by_side(driver.open(serial, &status));
///     left->configure({640, 480, 30}, nullptr);  // asks the camera for 1280 x 480
///     right->configure({640, 480, 30}, nullptr);
///
/// Pixels     Views into the picture, nothing is copied. Both images of an exposure have its
///            counter and its stamps.
/// Ownership  The two own `whole` together. A slot of it goes back when both have released it: who
///            waits on one half alone runs out of slots.
/// Threads    As CameraDevice for each; wait() of the two on one thread, or one waits as long as
///            the other does. `whole` may be any camera.
/// Calls      configure() of the second must ask for the size that the first has (else
///            `bad_configuration`). stop() of either ends both, one start() each begins them again.
///            trigger_once() of the left is the exposure of both; exposure and gain are both's.
/// Disconnect Each half reports it once, and start() gives `disconnected` until both have.
[[nodiscard]] std::pair<std::unique_ptr<CameraDevice>, std::unique_ptr<CameraDevice>>
split_side_by_side(std::unique_ptr<CameraDevice> whole);

}  // namespace vergence
