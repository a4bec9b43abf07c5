#pragma once
#include <memory>
#include <span>

#include "drivers/camera.hpp"

/// GigE Vision cameras, by Aravis 0.8.
namespace vergence::gige {

/// Cameras that answer a broadcast, and any by its address: `serial` may be an IPv4 address.
///
/// enumerate() takes a second (the standard's time for answers); open() of a camera that is not
/// there two to four.
[[nodiscard]] std::unique_ptr<CameraDriver> make_driver();

/// What CameraConfiguration::options may hold: the table behind docs/cameras/gige.md.
struct OptionRow {
  const char* name;
  const char* values;  // in words: `on, off`, `µs`
  const char* fallback;
  const char* meaning;
};
[[nodiscard]] std::span<const OptionRow> option_rows() noexcept;

}  // namespace vergence::gige
