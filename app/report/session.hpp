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

/// Stands for a missing number.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

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

/// Line of calibrations.csv.
struct CalibrationRow {
  Stamp stamp{};
  bool accepted = false;
  /// True for a refinement that was not better than the calibration in use, which is no rejection.
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
  // Depth measured online at that time: its distance, its sigma, and the error of the calibration
  // in use.
  double reference_depth_m = kNone, depth_sigma_percent = kNone, depth_error_percent = kNone;
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
  /// Reasons of poses.csv, with the empty one first.
  std::vector<std::string> reasons{""};
  /// Poses of reference.tum.
  std::vector<StampedPose> reference{};
  std::vector<CalibrationRow> calibrations{};
  std::vector<Event> events{};
  /// Null if missing or invalid.
  nlohmann::json summary{};
  std::optional<CalibrationFile> calibration{};
  /// A message for each missing file.
  std::vector<std::string> missing{};
  /// A message for each file that is longer than the limit.
  std::vector<std::string> left_out{};

  /// Everything that the report lacks, first the files over the limit.
  [[nodiscard]] std::vector<std::string> not_had() const {
    std::vector<std::string> messages = left_out;
    messages.insert(messages.end(), missing.begin(), missing.end());
    return messages;
  }
};

/// 37 hours at 30 Hz; further frames are dropped and reported.
inline constexpr std::size_t kMaxFrames = 4'000'000;
inline constexpr std::size_t kMaxEvents = 200'000;
inline constexpr std::size_t kMaxCalibrations = 20'000;
/// Maximum number of characters of an external value or message.
inline constexpr std::size_t kLongestText = 300;

/// Reads the files line by line, without holding one in memory. Throws InputError if `folder` is
/// not a directory or has no session file.
[[nodiscard]] Session read_session(const std::filesystem::path& folder);

/// True if it was recorded from devices; false for a replay, or if unknown.
[[nodiscard]] bool is_live(const Session& session);

/// Finite number of summary.json by its path, such as `metrics.ate_m`; empty for anything else.
[[nodiscard]] std::optional<double> number_at(const nlohmann::json& json, std::string_view path);
/// Reads a boolean at a path.
[[nodiscard]] std::optional<bool> flag_at(const nlohmann::json& json, std::string_view path);
/// Reads a text at a path, cut at kLongestText.
[[nodiscard]] std::string text_at(const nlohmann::json& json, std::string_view path);

}  // namespace vergence::app::report
