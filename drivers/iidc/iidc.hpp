#pragma once
#include <memory>

#include "drivers/camera.hpp"

/// Industrial cameras of the FireWire class (IIDC 1.31), on USB and IEEE 1394; see
/// drivers/iidc/README.md.
namespace vergence::iidc {

/// Driver for cameras that have IIDC's registers on USB (Point Grey's Firefly, Chameleon, Flea3,
/// Grasshopper3), by libusb. `serial` is the GUID in hexadecimal or the number on the label.
[[nodiscard]] std::unique_ptr<CameraDriver> make_usb_driver();

/// Driver for cameras on IEEE 1394, by libdc1394 and the kernel's juju stack. Cameras of one driver
/// on one bus share its bandwidth and clock.
[[nodiscard]] std::unique_ptr<CameraDriver> make_1394_driver();

}  // namespace vergence::iidc
