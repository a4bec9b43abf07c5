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

/// A line of poses.csv, or of trajectory.tum where poses.csv is lost (then state and status are not
/// known).
struct Frame {
  Stamp stamp{};
  std::int64_t number = -1;
  std::optional<State> state{};
  std::optional<PoseStatus> status{};
  std::uint16_t reason = 0;  // Session::reasons
  bool posed = false;
  bool placed = false;    // enu and heading_deg mean something
  bool has_ins = false;   // ins means something
  bool compared = false;  // error means something
  Transform T_world_left{};
  std::array<double, 3> enu{}, ins{};  // m: east, north, up
  std::array<double, 3> error{};       // m: ours - INS, east, north, up
  double error_heading_deg = kNone;
  int inliers = -1;
  double estimate_ms = kNone;
};

/// A line of calibrations.csv.
struct CalibrationRow {
  Stamp stamp{};
  bool accepted = false;
  bool kept =
      false;  // a measurement of the drive that is no better than what is in use: no rejection
  bool decided = false;  // while driving; else the drive began with it
  std::string cause{}, reason{};
  std::int64_t frames = 0;
  double latency_frames = kNone, held_out_before_px = kNone, held_out_after_px = kNone;
  int camera = 1;
  std::array<double, 6> value{};  // rotation vector, rad; translation, m
  std::array<double, 6> sigma{};  // the wide one, else the noise's; meaningless without has_sigma
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
  std::vector<std::string> reasons{""};  // words of poses.csv, the empty one first
  std::vector<StampedPose> reference{};  // reference.tum
  std::vector<CalibrationRow> calibrations{};
  std::vector<Event> events{};
  nlohmann::json summary{};  // null when it is missing or no JSON
  std::optional<CalibrationFile> calibration{};
  std::vector<std::string> missing{};   // messages
  std::vector<std::string> left_out{};  // the same of files that are longer than is read

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

/// It was recorded from devices; else it is a replay, or nobody knows.
[[nodiscard]] bool is_live(const Session& session);

/// A finite number of summary.json by its path, `metrics.ate_m`. Nothing: not there, null, no
/// number.
[[nodiscard]] std::optional<double> number_at(const nlohmann::json& json, std::string_view path);
/// Reads a boolean at a path.
[[nodiscard]] std::optional<bool> flag_at(const nlohmann::json& json, std::string_view path);
/// Reads a text at a path, cut at kLongestText.
[[nodiscard]] std::string text_at(const nlohmann::json& json, std::string_view path);

}  // namespace vergence::app::report
