#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "app/config/configuration.hpp"
#include "core/types/calibration.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// The masks of a rig's cameras, `cameras.N.mask`: what of the vehicle or of dirt stands in the
/// picture.
///
/// A relative path begins at the configuration file's folder; is there nothing, or is there no such
/// file, at the working directory.
/// Ownership  Owns the pixels of views(). Threads: one caller.
/// Errors     InputError names key and file: one that is missing, damaged, of another size than the
///            camera's images, or hides all of them.
class CameraMasks {
 public:
  CameraMasks(const Configuration& configuration, const RigCalibration& rig);

  /// By camera: 0 where nothing is to be looked for. Empty: the camera has none.
  [[nodiscard]] std::array<ImageView, kMaxCameras> views() const noexcept;

 private:
  struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> pixels;
  };
  std::array<Image, kMaxCameras> images_{};
};

}  // namespace vergence::app
