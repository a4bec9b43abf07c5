#pragma once
#include <array>
#include <cstdint>

#include "app/config/configuration.hpp"
#include "core/types/calibration.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// Masks of a rig's cameras (`cameras.N.mask`), which hide parts of the vehicle or dirt in the
/// image.
///
/// A relative path refers to the configuration file's directory or, if missing there or without
/// such a file, to the working directory. Owns the pixels of views(). One caller. Throws InputError
/// with key and file for a mask that is missing, damaged, of another size than the images, or hides
/// everything.
class CameraMasks {
 public:
  CameraMasks(const Configuration& configuration, const RigCalibration& rig);

  /// Masks by camera: pixels of value 0 are not used. Empty if the camera has no mask.
  [[nodiscard]] const std::array<ImageView, kMaxCameras>& views() const noexcept { return views_; }

 private:
  std::array<std::vector<std::uint8_t>, kMaxCameras> pixels_;
  // Views of pixels_.
  std::array<ImageView, kMaxCameras> views_{};
};

}  // namespace vergence::app
