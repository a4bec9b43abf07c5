#include "app/runtime/nearest.hpp"

#include <array>

namespace vergence::app {

namespace {

// No key is similar to a word with more bytes than this; the limit bounds the cost.
constexpr std::size_t kLongest = 256;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

using Kind = Renamed::Kind;

constexpr std::string_view kCalibrateTarget = "'vergence calibrate target --left GLOB'";

constexpr std::array kRenamed{
    Renamed{Kind::key, "calibration.focal_lengths", "calibration.intrinsics: fixed, focal or full"},
    Renamed{Kind::key, "calibration.lenses", "calibration.intrinsics: fixed, focal or full"},
    Renamed{Kind::key, "odometry.first_pair", "odometry.init_features"},
    Renamed{Kind::key, "odometry.rig_turn_sigma", "odometry.extrinsic_rotation_sigma_rad"},
    Renamed{Kind::key, "calibration.drift_mrad",
            "calibration.extrinsic_random_walk_mrad_per_sqrt_h"},
    Renamed{Kind::key, "calibration.needs_near_points", "calibration.min_near_points"},
    Renamed{Kind::key, "calibration.tolerated_depth_percent",
            "calibration.max_depth_error_percent"},
    Renamed{Kind::key, "calibration.tolerated_depth_m", "calibration.reference_depth_m"},
    Renamed{Kind::key, "monitor.claimed_bias_px", "monitor.unverified_bias_px"},
    Renamed{Kind::key, "monitor.found_bias_px", "monitor.verified_bias_px"},
    Renamed{Kind::key, "comparison.placement_m", "comparison.alignment_distance_m"},
    Renamed{Kind::key, "record.roll_mb", "record.split_mb"},
    Renamed{Kind::key, "trigger.vary_us", "trigger.dither_us"},
    Renamed{Kind::key, "sync.hold_ms", "sync.timeout_ms"},
    Renamed{Kind::key, "cameras.0.half", "cameras.N.image_half"},
    Renamed{Kind::key, "publish.lines", "publish.pose_stream"},
    Renamed{Kind::value, "sync.mode counter", "frame_counter"},
    Renamed{Kind::value, "sync.mode software", "approximate_time"},
    Renamed{Kind::value, "sync.mode bus", "ieee1394_cycle_time"},
    Renamed{Kind::value, "sync.mode one_picture", "side_by_side"},
    Renamed{Kind::value, "calibration.intrinsics hold", "fixed or focal"},
    Renamed{Kind::value, "calibration.intrinsics refine", "full"},
    Renamed{Kind::option, "run --page", "--live-page"},
    Renamed{Kind::option, "replay --page", "--live-page"},
    Renamed{Kind::option, "run --memory", "--print-memory"},
    Renamed{Kind::option, "replay --memory", "--print-memory"},
    Renamed{Kind::option, "evaluate --estimate-mount", "--estimate-ins-extrinsics"},
    Renamed{Kind::option, "doctor --out", "--session-dir"},
    Renamed{Kind::option, "calibrate --left", kCalibrateTarget},
    Renamed{Kind::option, "calibrate --right", kCalibrateTarget},
    Renamed{Kind::option, "calibrate --camera", kCalibrateTarget},
    Renamed{Kind::option, "calibrate --drive", "'vergence calibrate sequence DATA'"},
    Renamed{Kind::option, "calibrate --convert", "'vergence calibrate convert IN OUT'"},
    // The first argument of calibrate that is no option.
    Renamed{Kind::option, "calibrate CONFIG", "'vergence calibrate live CONFIG'"},
};

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  a = a.substr(0, kLongest);
  b = b.substr(0, kLongest);
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0U : 1U)});
      const bool exchanged = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                             lower(a[i - 2]) == lower(b[j - 1]);
      if (exchanged) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& known) {
  const std::string* best = nullptr;
  std::size_t best_distance = 0;
  for (const std::string& k : known) {
    const std::size_t d = edit_distance(word, k);
    // One change for every three bytes is a slip; more of them make another word.
    if (3 * d > std::max(word.size(), k.size())) continue;
    if (best == nullptr || d < best_distance) {
      best = &k;
      best_distance = d;
    }
  }
  if (best == nullptr) return std::nullopt;
  return *best;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  const auto near = nearest(word, known);
  return near ? "; did you mean \"" + *near + "\"?" : std::string();
}

std::span<const Renamed> renamed() { return kRenamed; }

std::string new_name(Kind kind, std::string_view name) {
  const auto* row = std::ranges::find_if(
      kRenamed, [&](const Renamed& r) { return r.kind == kind && r.name == name; });
  return row == kRenamed.end() ? "" : "; it is now " + std::string(row->now);
}

}  // namespace vergence::app
