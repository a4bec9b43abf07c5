#pragma once
#include <memory>

#include "drivers/camera.hpp"

/// GigE Vision cameras, by Aravis 0.8.
namespace vergence::gige {

/// Cameras that answer a broadcast, and any by its address: `serial` may be an IPv4 address.
///
/// enumerate() takes a second (the standard's time for answers); open() of a camera that is not
/// there two to four.
[[nodiscard]] std::unique_ptr<CameraDriver> make_driver();

}  // namespace vergence::gige
