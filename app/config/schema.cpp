#include "app/config/schema.hpp"

#include <limits>

#include <fmt/format.h>

namespace vergence::app {
namespace {

/// Rows whose values are fields of one member of Configuration; the member itself for keys without a group.
template <class Settings>
class Rows {
 public:
  Rows(std::string group, std::string meaning, Settings Configuration::*member) : member_(member) {
    group_.name = std::move(group);
    group_.meaning = std::move(meaning);
  }

  /// Any integral field.
  template <class Integer>
  Rows& integer(const char* name, Integer Settings::*field, std::int64_t least, std::int64_t most, const char* unit, const char* meaning) {
    const auto member = member_;
    add(
        name, KeyType::integer, static_cast<double>(least), static_cast<double>(most), unit, meaning,
        [member, field](Configuration& c, const KeyValue& v) { (c.*member).*field = static_cast<Integer>(std::get<std::int64_t>(v)); },
        [member, field](const Configuration& c) -> KeyValue { return static_cast<std::int64_t>((c.*member).*field); });
    return *this;
  }

  Rows& number(const char* name, double Settings::*field, double least, double most, const char* unit, const char* meaning) {
    const auto member = member_;
    add(
        name, KeyType::number, least, most, unit, meaning,
        [member, field](Configuration& c, const KeyValue& v) { (c.*member).*field = std::get<double>(v); },
        [member, field](const Configuration& c) -> KeyValue { return (c.*member).*field; });
    return *this;
  }

  Rows& text(const char* name, std::string Settings::*field, std::size_t longest, const char* meaning) {
    const auto member = member_;
    add(
        name, KeyType::text, 0, static_cast<double>(longest), "", meaning,
        [member, field](Configuration& c, const KeyValue& v) { (c.*member).*field = std::get<std::string>(v); },
        [member, field](const Configuration& c) -> KeyValue { return (c.*member).*field; });
    return *this;
  }

  [[nodiscard]] Group done() { return std::move(group_); }

 private:
  void add(const char* name, KeyType type, double least, double most, const char* unit, const char* meaning,
           std::function<void(Configuration&, const KeyValue&)> set, std::function<KeyValue(const Configuration&)> get) {
    group_.keys.push_back({group_.name + "." + name, type, unit, least, most, meaning, std::move(set), std::move(get)});
  }

  Settings Configuration::*member_;
  Group group_;
};

Group general() {
  Group group;
  group.meaning = "Keys that belong to no group.";
  group.keys.push_back(
      {"threads", KeyType::integer, "", 1, 2,
       "Threads of the estimator: with 2 the second image is searched and tracked beside the first; the poses are the same.",
       [](Configuration& c, const KeyValue& v) { c.threads = static_cast<int>(std::get<std::int64_t>(v)); },
       [](const Configuration& c) -> KeyValue { return std::int64_t{c.threads}; }});
  return group;
}

Group rig() {
  return Rows("rig", "The rig as a whole.", &Configuration::rig)
      .text("name", &RigSettings::name, 64, "Name of the rig in the calibration.yaml that a session writes.")
      .done();
}

Group odometry() {
  using O = OdometryOptions;
  constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();
  Rows rows("odometry", "How motion is found from the images. The defaults suit road vehicles and hand-held rigs; change one at a time.",
            &Configuration::odometry);
  rows.integer("features", &O::features, 50, 1000, "points",
               "Points tracked in each image: more of them cost time and hold the pose better where texture is poor. They are spread "
               "over a grid of cells of the size that this number asks for.")
      .integer("pyramid_levels", &O::pyramid_levels, 2, 6, "levels",
               "Sizes of the image that are searched, each half of the one before: more levels follow faster motion.")
      .number("min_corner_score", &O::min_corner_score, 0.01, 1e5, "grey² / px²",
              "Contrast that a corner needs to be tracked (least eigenvalue of the structure tensor): lower it for dim images.")
      .number("nearest_baselines", &O::nearest_baselines, 1, 50, "baselines",
              "Nearest depth at which a point is looked for in the other image, as a multiple of the baseline; nearer ones are not found.")
      .number("band_px", &O::band_px, 0.5, 20, "px",
              "Half the width of the band along the epipolar line in which a match across is sought: wide for a poor calibration.")
      .number("match_zncc", &O::match_zncc, 0.5, 0.99, "",
              "Least normalised correlation of the two image patches of a match across (1: the same picture).")
      .number("pixel_sigma", &O::pixel_sigma, 0.02, 5, "px",
              "Standard deviation of a tracked corner's position, each coordinate, at full resolution; the scale of all residuals.")
      .number("parallax_sigma", &O::parallax_sigma, 0, 10, "px",
              "Added to it (in quadrature) for a patch seen from one depth further to the side than where it was cut: its slope is unknown.")
      .number("huber", &O::huber, 1, 10, "sigmas", "Residuals beyond this count less and less (Huber's weight).")
      .integer("window_keyframes", &O::window_keyframes, 3, 20, "keyframes", "Keyframes that are adjusted together with their points.")
      .integer("window_steps", &O::window_steps, 1, 30, "steps", "Most solver steps of one such adjustment.")
      .number("keyframe_parallax", &O::keyframe_parallax, 0.005, 0.3, "rad",
              "Median turn of the rays to the points since the last keyframe that makes a new one.")
      .number("keyframe_tracked", &O::keyframe_tracked, 0.1, 1, "",
              "A new keyframe is made when less than this share of the last one's points is still tracked.")
      .integer("min_inliers", &O::min_inliers, 6, 200, "points", "A pose on fewer points than this is not believed: status `lost`.")
      .integer("ok_inliers", &O::ok_inliers, 6, 1000, "points",
               "A pose on fewer points than this is `degraded` with the reason `few_inliers`; not below `min_inliers`.")
      .number("max_gap_s", &O::max_gap_s, 0.05, 5, "s",
              "Longest time between two frames over which motion is predicted; longer is a `time_gap`.")
      .integer("mlesac_hypotheses", &O::mlesac_hypotheses, 10, 1000, "", "Most poses tried on random point triples, a frame.")
      .integer("seed", &O::seed, 0, kLargestSeed, "", "Seed of that sampling: the same seed gives the same poses.");
  return rows.done();
}

}  // namespace

const std::vector<Group>& schema() {
  static const std::vector<Group> groups{general(), rig(), odometry()};
  return groups;
}

std::string find_contradiction(const Configuration& c) {
  if (c.odometry.ok_inliers < c.odometry.min_inliers)
    return fmt::format("odometry.ok_inliers ({}) is below odometry.min_inliers ({}); a pose would be lost before it is degraded",
                       c.odometry.ok_inliers, c.odometry.min_inliers);
  return {};
}

std::string to_text(const KeyValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

std::string range_text(const Key& key) {
  if (key.type == KeyType::text) return fmt::format("up to {} bytes", key.most);
  if (key.type == KeyType::number) return fmt::format("{} … {}", key.least, key.most);
  // The largest 64-bit integer is no double: as a bound it stands for "any".
  if (key.most >= 0x1p63) return fmt::format("from {}", key.least);
  return fmt::format("{} … {}", static_cast<std::int64_t>(key.least), static_cast<std::int64_t>(key.most));
}

}  // namespace vergence::app
