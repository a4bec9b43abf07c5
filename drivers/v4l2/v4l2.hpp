#pragma once
#include <memory>

#include "drivers/camera.hpp"

/// Cameras behind Video4Linux: USB video class, sensors on a board's own bridge, capture cards.
namespace vergence::v4l2 {

/// The driver for the table of drivers.
///
/// Serials    The USB serial number where the camera has one, else the bus the kernel names
///            (platform:…, usb-…); a second camera of the same serial gets "#1". open() takes a
///            path under /dev as well (also of /dev/v4l/by-path); info() has the camera's own then,
///            too.
/// Slots      The kernel's own buffers, mapped, for GREY and formats that begin with a luma plane
///            (NV12, NV21, YU12, YV12, NV16, 422P): no copy, rows as the driver lays them. Other
///            formats are turned to 8-bit grey into a FramePool slot, and the buffer goes back.
/// Threads    One of its own a camera, from start() to stop(): it alone talks to the kernel in
///            between.
/// Time       Stamps are CLOCK_MONOTONIC as the kernel gives them: a start of exposure is taken as
///            it is, an end of frame less read-out and exposure; where the driver gives none the
///            arrival serves, and timing() is wide.
/// Options    drivers/options/v4l2_options.hpp, drivers/v4l2/README.md.
/// Errors     configure(): also `busy`, another program streams from it. start(): also `failed`,
///            the message has the kernel's reason.
[[nodiscard]] std::unique_ptr<CameraDriver> make_driver();

}  // namespace vergence::v4l2
