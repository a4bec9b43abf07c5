#pragma once
#include <memory>
#include <utility>

#include "drivers/camera.hpp"

namespace vergence {

/// Splits a camera that delivers both images side by side in one frame, the left image first, as
/// stereo cameras on USB and camera boards on CSI do.
///
///     auto [left, right] = split_side_by_side(driver.open(serial, &status));
///     left->configure({640, 480, 30}, nullptr);  // asks the camera for 1280 x 480
///     right->configure({640, 480, 30}, nullptr);
///
/// Pixels     Both images are views of the frame, without a copy. They have the same counter and
///            stamps.
/// Ownership  Both halves own `whole` together. A slot is released when both halves have released
///            it; a consumer that waits on one half only runs out of slots.
/// Threads    Same contract as CameraDevice for each half. Call wait() of both on one thread, or
///            else a wait may last as long as that of the other half. `whole` may be any camera.
/// Calls      Both halves must configure the same size (else `bad_configuration`). stop() of either
///            stops both, and each half has to be started again. trigger_once() of the left half
///            exposes both; exposure and gain apply to both.
/// Disconnect Each half reports it once, and start() returns `disconnected` until both have.
[[nodiscard]] std::pair<std::unique_ptr<CameraDevice>, std::unique_ptr<CameraDevice>>
split_side_by_side(std::unique_ptr<CameraDevice> whole);

}  // namespace vergence
