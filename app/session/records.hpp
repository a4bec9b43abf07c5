#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "core/comparison/comparison.hpp"
#include "core/estimator/estimator.hpp"
#include "core/types/calibration.hpp"
#include "core/types/calibration_decision.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/stamped_pose.hpp"

/// What a session's observers are told: plain values of fixed size, made on the estimator's thread
/// without heap, copied through rings.
namespace vergence::app {

/// All that a session says of one frame that was read: its pose, placed on the earth beside the
/// INS where there is one, and what it took. A line of poses.csv and, unless lost, one of
/// trajectory.tum.
struct FrameReport : ComparedPose {
  float decode_ms = 0;
  /// The reference's pose of the left camera, in the reference's own frame.
  std::optional<Transform> T_reference_left{};

  /// Of a drive without an INS.
  [[nodiscard]] static FrameReport of(const PoseSample& sample, float decode_ms,
                                      const std::optional<Transform>& T_reference_left) noexcept;
  /// With the INS as the reference.
  [[nodiscard]] static FrameReport of(const ComparedPose& pose, float decode_ms) noexcept;
  /// ours − INS: east, north, up, m; heading, deg clockwise. Meaningful where `compared`.
  [[nodiscard]] std::array<double, 4> error() const noexcept;
};

/// A number or a constant word beside an event's sentence. `name` null: not used.
struct EventField {
  const char* name = nullptr;
  std::variant<std::int64_t, double, const char*> value{std::int64_t{0}};
};

/// A line of events.jsonl. `kind` and the fields' names point to constants.
struct EventRecord {
  Stamp stamp{};
  const char* kind = "";
  std::array<char, 256> sentence{};  // ends with 0
  std::array<EventField, 4> fields{};

  /// Cut at the array's end, at a whole UTF-8 character.
  void set_sentence(std::string_view text) noexcept;
  [[nodiscard]] static EventRecord of(const EstimatorEvent& event) noexcept;
};

/// A calibration that was accepted or rejected, or that the drive began with: a line of
/// calibrations.csv for every camera but the left one.
struct CalibrationRecord : CalibrationDecision {
  bool decided = true;        // while driving; false: the drive began with it
  const char* began_as = "";  // then: `given`, `state_file` …, a constant
  /// Where it is from, if the drive began with it; ends with 0. A copy, for who keeps a record may
  /// outlive the source that has the text.
  std::array<char, 256> origin{};

  /// What the drive begins with. `origin` is copied, cut at the array's end, at a whole UTF-8
  /// character; `cause` is a constant.
  [[nodiscard]] static CalibrationRecord begin(const RigCalibration& rig, Stamp stamp,
                                               const char* cause, std::string_view origin) noexcept;
  [[nodiscard]] std::string_view cause_word() const noexcept {
    return decided ? to_string(cause) : began_as;
  }
  /// The decision's reason, or the origin of what the drive began with.
  [[nodiscard]] const char* why() const noexcept { return decided ? reason : origin.data(); }
};

}  // namespace vergence::app
