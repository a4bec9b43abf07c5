#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/math/se3.hpp"

namespace vergence::test {

inline constexpr int kFilmWidth = 640, kFilmHeight = 480;

/// Renders into `folder`, unless these very images are there. Throws std::runtime_error.
void render_film(const std::filesystem::path& folder);

/// A rendered drive as files, made once on this machine and played into emulated cameras:
/// cameraK.raw (8-bit images of one size, one after the other) and truth.txt (of every image
/// T_first_left: rotation by rows and translation, metres).
///
/// The rig is nominal_rig() of tests/support/rendered_drive.hpp.
class Film {
 public:
  explicit Film(const std::filesystem::path& folder);
  [[nodiscard]] std::size_t pairs() const noexcept { return truth_.size(); }
  /// The last image stays.
  [[nodiscard]] std::span<const std::uint8_t> image(std::size_t camera, std::uint64_t number) const;
  /// p_first = T · p_left, at that image.
  [[nodiscard]] const Transform& T_first_left(std::size_t number) const {
    return truth_.at(number);
  }

 private:
  std::vector<std::uint8_t> images_[2];
  std::vector<Transform> truth_;
};

}  // namespace vergence::test
