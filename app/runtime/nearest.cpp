#include "app/runtime/nearest.hpp"

#include <array>

namespace vergence::app {

namespace {

constexpr std::size_t kLongest =
    256;  // bytes: no key is near a word longer than this, and the cost stays bounded

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

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
    if (2 * d > std::max(word.size(), k.size())) continue;
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

namespace {

using Kind = Withdrawn::Kind;

constexpr std::string_view kNoLine =
    "the mock's devices have no serial line; drivers on simulated lines are part of the tests";

constexpr std::string_view kCalibrateTarget = "'vergence calibrate target --left GLOB'";

constexpr std::array kTable{
    Withdrawn{Kind::key, "ins.sync_in",
              "the SyncIn setting of the device is kept; change it with the maker's program"},
    Withdrawn{Kind::key, "record.keep_s",
              "recordings are complete; record.split_mb splits files, sessions.quota_mb removes "
              "old sessions"},
    Withdrawn{Kind::key, "mock.ins_line", kNoLine},
    Withdrawn{Kind::key, "mock.ins_latency_timer_ms", kNoLine},
    Withdrawn{Kind::key, "mock.ins_late_percent", kNoLine},
    Withdrawn{Kind::key, "mock.ins_late_ms", kNoLine},
    Withdrawn{Kind::key, "mock.board_line", kNoLine},
    Withdrawn{Kind::key, "mock.board_latency_timer_ms", kNoLine},
    Withdrawn{Kind::key, "mock.board_late_percent", kNoLine},
    Withdrawn{Kind::key, "mock.board_late_ms", kNoLine},
    Withdrawn{Kind::camera_option, "chunks",
              "the exposure of a frame is read from the camera's settings"},
    Withdrawn{Kind::camera_option, "packet_socket", "images come by UDP"},
    Withdrawn{Kind::camera_option, "frame_retention_ms",
              "a frame waits for three of its intervals"},
    Withdrawn{Kind::camera_option, "trigger_overlap", "set feature.TriggerOverlap"},
    Withdrawn{Kind::camera_option, "trigger_delay_us", "set feature.TriggerDelay"},
    Withdrawn{Kind::camera_option, "exposure_mode", "set feature.ExposureMode"},
    Withdrawn{Kind::camera_option, "exposure_line",
              "set feature.LineSelector, feature.LineMode and feature.LineSource"},
    Withdrawn{Kind::camera_option, "heartbeat_ms", "set feature.GevHeartbeatTimeout"},
    Withdrawn{Kind::key, "record.raw",
              "device bytes are no longer recorded; record.images and record.ins hold all that a "
              "replay reads"},
    Withdrawn{Kind::key, "record.roll_s", "files are split by size alone; set record.split_mb"},
    Withdrawn{Kind::key, "odometry.min_corner_score",
              "corners are chosen by rank within the image"},
    Withdrawn{Kind::key, "odometry.nearest_baselines",
              "disparities are searched up to the image's width"},
    Withdrawn{Kind::key, "odometry.match_zncc", "matches are accepted by consistency"},
    Withdrawn{Kind::key, "odometry.max_gap_s",
              "gaps are measured in the intervals of the sequence itself"},
    Withdrawn{Kind::key, "monitor.lag_frames", "a lag is a whole frame, found by likelihood"},
    Withdrawn{Kind::key, "monitor.lag_sigmas", "a lag is a whole frame, found by likelihood"},
    Withdrawn{Kind::record_topic, "raw",
              "device bytes are no longer recorded; images and ins hold all that a replay reads"},
    Withdrawn{Kind::key, "record.image_format", "images are recorded as they are"},
    Withdrawn{Kind::key, "record.memory_mb", "six seconds of images wait for the disk"},
    Withdrawn{
        Kind::option, "run --also",
        "poses.csv has latitude, longitude and height of every frame; see docs/session_files.md"},
    Withdrawn{
        Kind::option, "replay --also",
        "poses.csv has latitude, longitude and height of every frame; see docs/session_files.md"},
    Withdrawn{Kind::option, "replay --distortion",
              "--focal estimates the distortion; put known coefficients into a calibration.yaml"},
    Withdrawn{Kind::option, "replay --through-devices",
              "a replay reads the recorded frames and INS samples, and gives the same poses"},
    Withdrawn{Kind::command, "completion",
              "'vergence --help' and 'vergence COMMAND --help' list commands and options"},
    Withdrawn{
        Kind::command, "manual",
        "man pages are part of the Debian package; 'vergence COMMAND --help' prints the same"},
    Withdrawn{Kind::key, "calibration.focal_lengths",
              "calibration.intrinsics: fixed, focal or full", true},
    Withdrawn{Kind::key, "calibration.lenses", "calibration.intrinsics: fixed, focal or full",
              true},
    Withdrawn{Kind::key, "odometry.first_pair", "odometry.init_features", true},
    Withdrawn{Kind::key, "odometry.rig_turn_sigma", "odometry.extrinsic_rotation_sigma_rad", true},
    Withdrawn{Kind::key, "calibration.drift_mrad",
              "calibration.extrinsic_random_walk_mrad_per_sqrt_h", true},
    Withdrawn{Kind::key, "calibration.needs_motion_m", "a path of three baselines is needed"},
    Withdrawn{Kind::key, "calibration.min_path_m", "a path of three baselines is needed"},
    Withdrawn{Kind::key, "calibration.rotation_sigma_mrad",
              "calibration.usable_depth_percent limits the sigma of depths"},
    Withdrawn{Kind::key, "calibration.translation_sigma_mm",
              "calibration.usable_depth_percent limits the sigma of depths"},
    Withdrawn{Kind::key, "calibration.needs_near_points", "calibration.min_near_points", true},
    Withdrawn{Kind::key, "calibration.tolerated_depth_percent",
              "calibration.max_depth_error_percent", true},
    Withdrawn{Kind::key, "calibration.tolerated_depth_m", "calibration.reference_depth_m", true},
    Withdrawn{Kind::key, "monitor.claimed_bias_px", "monitor.unverified_bias_px", true},
    Withdrawn{Kind::key, "monitor.found_bias_px", "monitor.verified_bias_px", true},
    Withdrawn{Kind::key, "comparison.placement_m", "comparison.alignment_distance_m", true},
    Withdrawn{Kind::key, "record.roll_mb", "record.split_mb", true},
    Withdrawn{Kind::key, "trigger.vary_us", "trigger.dither_us", true},
    Withdrawn{Kind::key, "sync.hold_ms", "sync.timeout_ms", true},
    Withdrawn{Kind::key, "cameras.0.half", "cameras.N.image_half", true},
    Withdrawn{Kind::key, "publish.lines", "publish.pose_stream", true},
    Withdrawn{Kind::value, "sync.mode counter", "frame_counter", true},
    Withdrawn{Kind::value, "sync.mode software", "approximate_time", true},
    Withdrawn{Kind::value, "sync.mode bus", "ieee1394_cycle_time", true},
    Withdrawn{Kind::value, "sync.mode one_picture", "side_by_side", true},
    Withdrawn{Kind::value, "calibration.intrinsics hold", "fixed or focal", true},
    Withdrawn{Kind::value, "calibration.intrinsics refine", "full", true},
    Withdrawn{Kind::option, "run --page", "--live-page", true},
    Withdrawn{Kind::option, "replay --page", "--live-page", true},
    Withdrawn{Kind::option, "run --memory", "--print-memory", true},
    Withdrawn{Kind::option, "replay --memory", "--print-memory", true},
    Withdrawn{Kind::option, "evaluate --estimate-mount", "--estimate-ins-extrinsics", true},
    Withdrawn{Kind::option, "doctor --out", "--session-dir", true},
    Withdrawn{Kind::option, "calibrate --left", kCalibrateTarget, true},
    Withdrawn{Kind::option, "calibrate --right", kCalibrateTarget, true},
    Withdrawn{Kind::option, "calibrate --camera", kCalibrateTarget, true},
    Withdrawn{Kind::option, "calibrate --drive", "'vergence calibrate sequence DATA'", true},
    Withdrawn{Kind::option, "calibrate --convert", "'vergence calibrate convert IN OUT'", true},
    // The first argument of calibrate that is no option.
    Withdrawn{Kind::option, "calibrate CONFIG", "'vergence calibrate live CONFIG'", true},
};

}  // namespace

std::span<const Withdrawn> withdrawn() { return kTable; }

std::string why_withdrawn(Kind kind, std::string_view name) {
  const auto* row = std::find_if(kTable.begin(), kTable.end(), [&](const Withdrawn& w) {
    return w.kind == kind && w.name == name;
  });
  if (row == kTable.end()) return "";
  return (row->renamed ? "; it is now " : "; it was removed: ") + std::string(row->instead);
}

}  // namespace vergence::app
