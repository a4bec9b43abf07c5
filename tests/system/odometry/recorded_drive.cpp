#include "tests/system/odometry/recorded_drive.hpp"

#include <algorithm>
#include <stdexcept>

#include "app/datasets/image_file.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "core/comparison/trajectory_metrics.hpp"

namespace vergence::test {
namespace {

OwnedImage decode(const std::filesystem::path& file, const Intrinsics& camera) {
  OwnedImage p(camera.width, camera.height);
  std::vector<std::uint8_t> bytes;
  if (app::read_image_file(file, &bytes) != app::ImageFileStatus::ok ||
      app::decode_grey(bytes, {p.width, p.height}, p.bytes.data(),
                       static_cast<std::size_t>(p.stride)) != app::ImageFileStatus::ok)
    throw std::runtime_error(file.string() + " cannot be decoded");
  return p;
}

}  // namespace

StereoDrive load(const Excerpt& excerpt, const std::filesystem::path& folder) {
  const app::StereoSequence sequence = app::open_sequence(excerpt.format, folder);
  const app::Trajectory truth = app::read_trajectory_file(folder).poses;
  StereoDrive drive;
  drive.rig = sequence.calibration;
  for (std::size_t i = 0; i < std::min(excerpt.frames, sequence.pairs.size()); ++i) {
    const app::StereoPair& pair = sequence.pairs[i];
    const std::vector<StampedPose> here{{pair.stamp, Transform{}}};
    const MatchedTrajectories matched = associate(here, truth, {});
    if (matched.reference.empty()) continue;
    drive.stamps.push_back(pair.stamp);
    drive.truth.push_back(matched.reference[0].T_world_body);
    drive.pairs.push_back({decode(sequence.root / pair.file[0], drive.rig.intrinsics[0]),
                           decode(sequence.root / pair.file[1], drive.rig.intrinsics[1])});
  }
  return drive;
}

}  // namespace vergence::test
