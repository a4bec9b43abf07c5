#pragma once
#include <memory>

#include "drivers/camera.hpp"

/// GigE Vision cameras, by Aravis 0.8.
namespace vergence::gige {

/// Driver for cameras that respond to a broadcast. open() also takes an IPv4 address as `serial`.
///
/// enumerate() takes one second (the standard's time for responses), open() of an absent camera two
/// to four.
[[nodiscard]] std::unique_ptr<CameraDriver> make_driver();

}  // namespace vergence::gige
