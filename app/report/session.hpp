#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/config/calibration_file.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::app::report {

inline constexpr double kNone =
    std::numeric_limits<double>::quiet_NaN();  // a number that is not there

/// A line of poses.csv.
struct Frame {
  Stamp stamp{};
  std::int64_t number = -1;
  State state{};
  PoseStatus status{};
  /// Index into Session::reasons.
  std::uint16_t reason = 0;
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

/// A line of calibrations.csv.
struct CalibrationRow {
  Stamp stamp{};
  bool accepted = false;
  /// A refinement that is no better than the calibration in use; this is no rejection.
  bool kept = false;
  /// Decided while driving; false for the initial calibration.
  bool decided = false;
  std::string cause{}, reason{};
  std::int64_t frames = 0;
  double latency_frames = kNone, held_out_before_px = kNone, held_out_after_px = kNone;
  int camera = 1;
  /// Rotation vector, rad, and translation, m.
  std::array<double, 6> value{};
  /// Total sigma, or that of the noise alone; valid if has_sigma.
  std::array<double, 6> sigma{};
  bool has_sigma = false;
  // Depth measured online by then: its distance, its sigma, and the error
  // of the calibration in use.
  double reference_depth_m = kNone, depth_sigma_percent = kNone, depth_error_percent = kNone;
};

struct Event {
  Stamp stamp{};
  std::string kind{}, message{};
};

/// Stamps of `frames` and of `reference` ascend strictly; rows that break this are left out and
/// told in `missing`.
struct Session {
  std::string name{};
  std::vector<Frame> frames{};
  /// Reasons of poses.csv, with the empty one first.
  std::vector<std::string> reasons{""};
  /// Poses of reference.tum.
  std::vector<StampedPose> reference{};
  std::vector<CalibrationRow> calibrations{};
  std::vector<Event> events{};
  nlohmann::json summary{};  // null when it is missing or no JSON
  std::optional<CalibrationFile> calibration{};
  /// A message for each missing file.
  std::vector<std::string> missing{};
  /// A message for each file that is longer than the limit.
  std::vector<std::string> left_out{};

  /// All that the report does not have: what was left out first.
  [[nodiscard]] std::vector<std::string> not_had() const {
    std::vector<std::string> messages = left_out;
    messages.insert(messages.end(), missing.begin(), missing.end());
    return messages;
  }
};

inline constexpr std::size_t kMaxFrames =
    4'000'000;  // 37 hours at 30 Hz; further ones are left out and told
inline constexpr std::size_t kMaxEvents = 200'000;
inline constexpr std::size_t kMaxCalibrations = 20'000;
inline constexpr std::size_t kLongestText =
    300;  // characters kept of a word or message from outside

/// Reads what is there, line by line: no file is held in memory. Errors  InputError: `folder` is no
/// folder, or none of a session's files is in it.
[[nodiscard]] Session read_session(const std::filesystem::path& folder);

/// True if it was recorded from devices; false for a replay, or if unknown.
[[nodiscard]] bool is_live(const Session& session);

/// A finite number of summary.json by its path, `metrics.ate_m`. Nothing: not there, null, no
/// number.
[[nodiscard]] std::optional<double> number_at(const nlohmann::json& json, std::string_view path);
/// Reads a boolean at a path.
[[nodiscard]] std::optional<bool> flag_at(const nlohmann::json& json, std::string_view path);
/// Reads a text at a path, cut at kLongestText.
[[nodiscard]] std::string text_at(const nlohmann::json& json, std::string_view path);

}  // namespace vergence::app::report
