#pragma once
#include <cstddef>
#include <filesystem>

#include "app/datasets/stereo_sequence.hpp"
#include "tests/system/odometry/stereo_drive.hpp"

namespace vergence::test {

/// A recorded sequence with ground truth.
struct Excerpt {
  const char* name;
  const char* folder;  // below the shared root
  app::SequenceFormat format;
  std::size_t frames;  // all of them, or enough of them
};
inline constexpr Excerpt kKitti{"kitti", "data/kitti06_51", app::SequenceFormat::kitti, 51};
inline constexpr Excerpt kEuroc{"euroc", "data/euroc_mh01", app::SequenceFormat::euroc, 80};

/// The frames that have a ground truth, decoded. Throws what the readers of files throw.
[[nodiscard]] StereoDrive load(const Excerpt& excerpt, const std::filesystem::path& folder);

}  // namespace vergence::test
