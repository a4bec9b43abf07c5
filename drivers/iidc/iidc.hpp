#pragma once
#include <memory>

#include "drivers/camera.hpp"

/// FireWire-class industrial cameras (IIDC 1.31), over USB and over IEEE 1394.
/// drivers/iidc/README.md, drivers/iidc/README.md
namespace vergence::iidc {

/// Cameras that carry IIDC's registers over USB (Point Grey's Firefly, Chameleon, Flea3,
/// Grasshopper3), through libusb.
/// `serial`: GUID in hexadecimal, or the number on the label.
[[nodiscard]] std::unique_ptr<CameraDriver> make_usb_driver();

/// Cameras on IEEE 1394, through libdc1394 and the kernel's juju stack. Cameras that are opened by
/// one driver and hang on one bus share its budget of bandwidth and its clock.
[[nodiscard]] std::unique_ptr<CameraDriver> make_1394_driver();

}  // namespace vergence::iidc
