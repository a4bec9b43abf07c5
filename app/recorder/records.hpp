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

/// What goes through the recorder's rings: plain values of fixed size, made on the estimator's
/// thread without heap.
namespace vergence::app {

/// A rigid transform as numbers.
struct PoseNumbers {
  std::array<double, 3> t{};            // m
  std::array<double, 4> q{0, 0, 0, 1};  // x y z w

  [[nodiscard]] static PoseNumbers of(const Transform& T) noexcept;
  [[nodiscard]] Transform transform() const noexcept;
};

/// A place and a direction on the earth as numbers.
struct EarthNumbers {
  std::array<double, 3> enu{};  // m
  Geodetic position{};
  double heading_deg = 0;  // clockwise from north

  [[nodiscard]] static EarthNumbers of(const EarthPose& pose) noexcept;
};

/// One frame that was read: a line of poses.csv and, unless lost, one of trajectory.tum.
struct PoseRecord {
  std::uint64_t frame = 0;
  Stamp stamp{};
  State state = State::initialising;
  PoseStatus status = PoseStatus::lost;
  Reason reason = Reason::none;
  PoseNumbers world_left{};
  bool has_reference = false;
  PoseNumbers reference_left{};  // in the reference's own frame; meaningful with has_reference
  bool placed = false, ins_valid = false,
       compared = false;  // as in ComparedPose: whether the next three mean something
  EarthNumbers ours{}, ins{};
  std::array<double, 4> error{};  // ours − INS: east, north, up, m; heading, deg clockwise
  int inliers = 0;
  double reprojection_px = 0;
  std::array<float, kStages> stage_ms{};
  float estimate_ms = 0;
  FrameEffort effort{};
  float decode_ms = 0;

  [[nodiscard]] static PoseRecord of(const PoseSample& sample, float decode_ms,
                                     const std::optional<Transform>& T_reference_left) noexcept;
  /// With the INS as the reference.
  [[nodiscard]] static PoseRecord of(const ComparedPose& pose, float decode_ms) noexcept;
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

/// A rig's calibration as numbers.
struct RigNumbers {
  int cameras = 0;
  std::array<Intrinsics, kMaxCameras> intrinsics{};
  std::array<std::array<double, 12>, kMaxCameras> T_camera_left{};  // rows of [R t]
  std::array<std::array<double, 6>, kMaxCameras> sigma_noise{}, sigma_wide{};
  std::array<std::array<double, 21>, kMaxCameras> covariance_wide{};  // upper triangle
  double baseline = 0, baseline_sigma = 0;
  Stamp found{};
  int frames = 0;
  double reprojection_px = 0, scale_sigma = 0, inflation = 0;
  RigCovariance covariance{};

  [[nodiscard]] static RigNumbers of(const RigCalibration& rig) noexcept;
  [[nodiscard]] RigCalibration rig() const noexcept;
};

/// A calibration that was accepted or rejected, or that the drive began with: a line of
/// calibrations.csv for every camera but the left one.
struct CalibrationRecord {
  Stamp stamp{};
  bool decided = false;  // while driving; false: the drive began with it
  bool accepted = true;
  const char* cause =
      "";  // of a decision the word of its CalibrationCause, else `given`, `state_file`
  const char* reason = "";  // of a decision: a constant
  /// Where it is from, if the drive began with it; ends with 0. A copy, for who keeps a record may
  /// outlive the source that has the text.
  std::array<char, 256> origin{};
  int latency_frames = 0;
  std::uint64_t onset_frame = 0;
  double held_out_before_px = 0, held_out_after_px = 0;
  double solve_ms = 0;
  bool learnt = false;  // what the drive measured while it went on: not accepted is no rejection,
                        // the one in use fits as well
  double judged_depth_m = 0, depth_sigma_percent = 0,
         depth_difference_percent = 0;  // as CalibrationDecision has them
  bool verified = false, lenses = false;
  FocalMeasurement focal{};
  RigNumbers rig{};

  [[nodiscard]] static CalibrationRecord of(const CalibrationDecision& decision) noexcept;
  /// What the drive begins with. `origin` is copied, cut at the array's end, at a whole UTF-8
  /// character; `cause` is a constant.
  [[nodiscard]] static CalibrationRecord begin(const RigCalibration& rig, Stamp stamp,
                                               const char* cause, std::string_view origin) noexcept;
  /// The decision's reason, or the origin of what the drive began with.
  [[nodiscard]] const char* why() const noexcept { return decided ? reason : origin.data(); }
};

using Record = std::variant<PoseRecord, EventRecord>;

}  // namespace vergence::app
