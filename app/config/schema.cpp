#include "app/config/schema.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "app/config/detail/schema_groups.hpp"
#include "app/runtime/realtime.hpp"

namespace vergence::app {

const std::vector<Group>& schema() {
  static const std::vector<Group> all{
      groups::general(),  groups::rig(),        groups::cameras(),
      groups::exposure(), groups::ins(),        groups::trigger(),
      groups::sync(),     groups::odometry(),   groups::calibration_options(),
      groups::monitor(),  groups::comparison(), groups::kitti_raw(),
      groups::mock(),     groups::record(),     groups::publish(),
      groups::realtime(), groups::faults()};
  return all;
}

namespace {

/// What of a camera's lens would be read by nobody.
std::string find_unread_lens(const CameraSettings& camera, std::size_t k) {
  const auto given = [](double v) { return v != 0; };
  const auto& numbers = camera.intrinsics;
  const bool none = std::none_of(numbers.begin(), numbers.end(), given);
  if (!none && !std::all_of(numbers.begin(), numbers.end(), given))
    return fmt::format(
        "cameras.{}.intrinsics is [{}]; it takes all four of fx, fy, cx, cy in pixels, or none", k,
        fmt::join(numbers, ", "));
  if (none && std::any_of(camera.distortion.begin(), camera.distortion.end(), given))
    return fmt::format(
        "cameras.{}.distortion is given without cameras.{}.intrinsics, so that the lens is that of "
        "rig.nominal with rig.nominal.k1 and k2; give the intrinsics, too",
        k, k);
  if (camera.model == CameraModelKind::pinhole_equidistant && given(camera.distortion[4]))
    return fmt::format(
        "cameras.{}.distortion has five coefficients; a pinhole-equidistant lens has k1 to k4", k);
  return {};
}

}  // namespace

std::string find_contradiction(const Configuration& c) {
  for (std::size_t k = 0; k < c.cameras.size(); ++k)
    if (std::string unread = find_unread_lens(c.cameras[k], k); !unread.empty()) return unread;
  if (c.odometry.ok_inliers < c.odometry.min_inliers)
    return fmt::format(
        "odometry.ok_inliers ({}) is below odometry.min_inliers ({}); a pose would be lost before "
        "it is degraded",
        c.odometry.ok_inliers, c.odometry.min_inliers);
  if (c.calibration.max_frames < c.calibration.min_frames)
    return fmt::format(
        "calibration.max_frames ({}) is below calibration.min_frames ({}); no calibration would "
        "ever be tried",
        c.calibration.max_frames, c.calibration.min_frames);
  if (c.calibration.usable_depth_percent < c.calibration.good_depth_percent)
    return fmt::format(
        "calibration.usable_depth_percent ({}) is below calibration.good_depth_percent ({})",
        c.calibration.usable_depth_percent, c.calibration.good_depth_percent);
  for (const auto& [key, list] :
       {std::pair<const char*, const std::string&>{"affinity", c.realtime.affinity},
        {"solver_affinity", c.realtime.solver_affinity}})
    if (!list.empty() && !parse_cpu_list(list))
      return fmt::format(
          "realtime.{} ({}) is no list of processors; write numbers and ranges, as 0-1,3", key,
          list);
  return {};
}

std::string to_text(const KeyValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

std::string range_text(const Key& key) {
  if (!key.words.empty()) return fmt::format("{}", fmt::join(key.words, ", "));
  if (key.type == KeyType::text) return fmt::format("up to {} bytes", key.most);
  if (key.type == KeyType::number) return fmt::format("{} … {}", key.least, key.most);
  // The largest 64-bit integer is no double: as a bound it stands for "any".
  if (key.most >= 0x1p63) return fmt::format("from {}", key.least);
  return fmt::format("{} … {}", static_cast<std::int64_t>(key.least),
                     static_cast<std::int64_t>(key.most));
}

}  // namespace vergence::app
