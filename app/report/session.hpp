#pragma once
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/types/calibration.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::app::report {

/// Stands for a missing number.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A line of poses.csv.
struct Frame {
  Stamp stamp{};
  State state{};
  PoseStatus status{};
  Reason reason = Reason::none;
  bool posed = false;
  /// True if enu and heading_deg are valid.
  bool placed = false;
  /// True if ins is valid.
  bool has_ins = false;
  /// True if error is valid.
  bool compared = false;
  Transform T_world_left{};
  /// East, north, up, m.
  std::array<double, 3> enu{}, ins{};
  /// Estimate minus INS: east, north, up, m.
  std::array<double, 3> error{};
  double error_heading_deg = kNone;
  int inliers = -1;
  double estimate_ms = kNone;
};

/// Line of calibrations.csv.
struct CalibrationRow {
  Stamp stamp{};
  bool accepted = false;
  /// True for a refinement that was not better than the calibration in use, which is no rejection.
  bool kept = false;
  /// Decided while driving; false for the initial calibration.
  bool decided = false;
  std::string cause{}, reason{};
  double held_out_before_px = kNone, held_out_after_px = kNone;
  int camera = 1;
  /// Rotation vector, rad, and translation, m.
  std::array<double, 6> value{};
  /// Total sigma, or that of the noise alone; valid if has_sigma.
  std::array<double, 6> sigma{};
  bool has_sigma = false;
  /// Depth measured online at that time: its distance and its sigma.
  double reference_depth_m = kNone, depth_sigma_percent = kNone;
};

struct Event {
  Stamp stamp{};
  std::string kind{}, message{};
};

/// Content of a session. Stamps of `frames` and `reference` increase strictly; other rows are
/// dropped and reported in `missing`.
struct Session {
  std::string name{};
  std::vector<Frame> frames{};
  /// Poses of reference.tum.
  std::vector<StampedPose> reference{};
  std::vector<CalibrationRow> calibrations{};
  std::vector<Event> events{};
  /// Null if missing or invalid.
  nlohmann::json summary{};
  /// A message for each file that is missing, truncated or damaged.
  std::vector<std::string> missing{};
};

/// Reads the files line by line, without holding one in memory. Throws InputError if `folder` is
/// not a directory or has no session file.
[[nodiscard]] Session read_session(const std::filesystem::path& folder);

/// Finite number of summary.json by its path, such as `metrics.ate_m`; empty for anything else.
[[nodiscard]] std::optional<double> number_at(const nlohmann::json& json, std::string_view path);
/// Reads a boolean at a path.
[[nodiscard]] std::optional<bool> flag_at(const nlohmann::json& json, std::string_view path);
/// Reads a text at a path; empty if there is none.
[[nodiscard]] std::string text_at(const nlohmann::json& json, std::string_view path);

}  // namespace vergence::app::report
