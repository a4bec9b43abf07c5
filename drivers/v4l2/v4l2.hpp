#pragma once
#include <memory>

#include "drivers/camera.hpp"

/// Video4Linux cameras: USB video class, sensors on a board's own bridge, capture cards.
namespace vergence::v4l2 {

/// Driver for the table of drivers.
///
/// Serials    The USB serial number, or the bus named by the kernel (platform:…, usb-…); a second
///            camera of the same serial gets "#1". open() also takes a path under /dev (and
///            /dev/v4l/by-path).
/// Slots      The kernel's mapped buffers for GREY and formats that begin with a luma plane (NV12,
///            NV21, YU12, YV12, NV16, 422P): no copy, rows as the driver lays them out. Other
///            formats are converted to 8-bit grey into a FramePool slot, and the buffer is
///            returned.
/// Threads    One thread per camera from start() to stop(); while it runs, only it accesses the
///            kernel.
/// Time       Stamps are on CLOCK_MONOTONIC. A stamp at the end of a frame is moved back by readout
///            and exposure. Without stamps the arrival is used, and timing() is wide.
/// Options    drivers/options/v4l2_options.hpp, drivers/v4l2/README.md.
/// Errors     configure() may also return `busy` (another program streams), start() `failed` with
///            the kernel's reason in the message.
[[nodiscard]] std::unique_ptr<CameraDriver> make_driver();

}  // namespace vergence::v4l2
