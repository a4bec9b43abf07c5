#pragma once
#include <array>
#include <optional>

#include "core/calibration/disparity_jump.hpp"
#include "core/calibration/gates.hpp"
#include "core/calibration/monitor.hpp"
#include "core/calibration/motion_track_builder.hpp"
#include "core/calibration/rig_solver.hpp"
#include "core/calibration/track_log.hpp"
#include "core/estimator/estimator.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {

/// The rig's calibration while it drives (METHOD §3, §6): logs the tracks, watches that they fit,
/// has calibrations solved beside the frames and decides about them. The estimator tells it what
/// was posed and follows its advice; states are the estimator's.
///
/// Two things are solved for. *Seeking*: there is no calibration, or the one in use is doubted;
/// frames since the onset, until one passes the gates. *Learning*: all the time else; what the
/// drive itself measures, lenses free, confirms the calibration in use, or contradicts it, or
/// refines it. Learning grows a segment of frames, solving again and again; a full segment is
/// closed, and what it told is the next one's prior.
///
///     calibrator.log(odometry, out, frame);  // of every posed frame
///     if (calibrator.can_solve()) calibrator.start_solve();
///     if (const auto decision = calibrator.decide(frame.stamp, frame.number))
///       if (decision->accepted) calibrator.use(decision->calibration, decision->lenses);
///
/// Threads one, but for the solver's task. Memory from the arena at construction.
class OnlineCalibrator {
 public:
  OnlineCalibrator(const EstimatorOptions& options, const RigCalibration& rig,
                   const RigCalibration& nominal, Arena& arena, BackgroundRunner& solver);
  [[nodiscard]] static std::size_t memory_needed(const EstimatorOptions& options,
                                                 const RigCalibration& rig) noexcept;

  /// What a posed frame saw goes into the log, if the rig has moved since the last one that did.
  void log(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome,
           const RigFrame& frame) noexcept;
  [[nodiscard]] const calibration::TrackLog& tracks() const noexcept { return log_; }

  /// The worst verdict of the further cameras' monitors on a posed frame; linked odometry only.
  [[nodiscard]] calibration::MonitorVerdict watch(const odometry::Odometry& odometry,
                                                  const odometry::FrameOutcome& outcome,
                                                  const RigFrame& frame) noexcept;
  /// Frame by frame while the rig is sought with the cameras unlinked: the first frame of a rig
  /// that has changed meanwhile, if it has.
  [[nodiscard]] std::optional<std::uint64_t> watch_sought(const odometry::Odometry& odometry,
                                                          const odometry::FrameOutcome& outcome,
                                                          std::uint64_t number) noexcept;

  /// From now on a calibration is sought. Frames before `onset` belong to another rig and are
  /// forgotten, and so is a solve of them that is still under way.
  void seek(CalibrationCause cause, std::uint64_t onset, std::uint64_t now) noexcept;
  [[nodiscard]] bool seeking() const noexcept { return seeking_; }
  /// There are frames enough to solve from and no solve is under way.
  [[nodiscard]] bool can_solve() const noexcept;
  /// Takes a snapshot and starts the solver on it.
  void start_solve() noexcept;
  [[nodiscard]] bool solving() const noexcept { return solving_; }
  /// After every frame. A value: the solve is over and decided.
  [[nodiscard]] std::optional<CalibrationDecision> decide(Stamp stamp,
                                                          std::uint64_t number) noexcept;
  /// How long the last decide() waited for the solver: with Adoption::after_fixed_frames only, a
  /// live drive never does.
  [[nodiscard]] float waited_ms() const noexcept { return waited_ms_; }
  /// No more frames come: waits for the solve under way and decides.
  [[nodiscard]] std::optional<CalibrationDecision> decide_now(Stamp stamp,
                                                              std::uint64_t number) noexcept;
  /// And this begins one with whatever is logged; false: that is too little.
  [[nodiscard]] bool start_last_solve() noexcept;
  [[nodiscard]] calibration::Gate last_gate() const noexcept { return gate_; }

  /// What the calibration sought waits for: needs_motion, needs_near_structure; `none` if nothing
  /// is known to be missing.
  [[nodiscard]] Reason missing() const noexcept;

  /// Waits for the solver's task, which writes into this.
  void finish() noexcept {
    if (solving_) runner_.wait();
  }
  /// Another calibration is in use, whose scene has just been made; it is watched from here on.
  void scene_rebuilt(const odometry::Odometry& odometry) noexcept;
  /// A calibration is adopted and its scene not yet made.
  [[nodiscard]] bool relink_pending() const noexcept { return relink_pending_; }
  /// Frames until now do not speak of the rig from here on: monitors and log begin again, the
  /// calibration in use stays.
  void begin_anew() noexcept;
  /// The scene was lost: what is logged does not go on.
  void scene_lost() noexcept;
  /// The calibration in use is this one, which the drive has found; `lenses`: with them.
  void use(const RigCalibration& rig, bool lenses) noexcept;
  /// The same while learning goes on: the frames stay.
  void refine(const RigCalibration& rig) noexcept;
  /// The one in use goes on: what was sought is no better.
  void keep() noexcept;
  [[nodiscard]] const RigCalibration& in_use() const noexcept { return rig_; }
  [[nodiscard]] bool calibrated() const noexcept { return calibrated_; }
  /// The drive itself has confirmed the calibration in use (METHOD §6.4).
  /// After an outage it has to confirm it again, from frames since then alone: epipolar lines,
  /// which a few frames are enough for, do not show a yaw.
  [[nodiscard]] bool verified() const noexcept { return verified_ && watched_; }
  /// It has confirmed one before: what does not fit since then is a change of the rig.
  [[nodiscard]] bool ever_verified() const noexcept { return ever_verified_; }
  /// Frames in a row that agree with the calibration in use.
  [[nodiscard]] int frames_agreed() const noexcept;

 private:
  struct SolveTask {
    OnlineCalibrator* calibrator;
    void operator()() const noexcept;
  };
  /// The solutions of one snapshot: with the lenses as they are, and with the lenses free.
  struct Solved {
    calibration::RigSolution transforms, lenses;
  };
  /// The monitor of camera k watches this transform from now on.
  void watch_against(int k, const Transform& T_camera_left, const Mat6& covariance) noexcept;
  void watch_calibration() noexcept;
  void set_verified(bool verified) noexcept;
  /// What cannot be told from a claim is told by the monitor's own measurement: it takes what it
  /// sees in the first frames that agree with each other as what must not change.
  void learn_reference(int k, const calibration::MonitorVerdict& verdict) noexcept;
  [[nodiscard]] CalibrationDecision begin_decision(
      Stamp stamp, std::uint64_t number, const calibration::RigSolution& found) const noexcept;
  [[nodiscard]] calibration::AcceptanceInput question(const calibration::RigSolution& found,
                                                      bool last) const noexcept;
  /// `last`: no more frames come that could make it better.
  [[nodiscard]] CalibrationDecision judge_sought(Stamp stamp, std::uint64_t number,
                                                 bool last) noexcept;
  [[nodiscard]] CalibrationDecision judge_learnt(Stamp stamp, std::uint64_t number,
                                                 bool last) noexcept;
  void assess_lenses(const RigCalibration& in_use_then, std::uint64_t newest,
                     CalibrationDecision* d) const noexcept;
  /// Lenses are taken from the drive where it shows that the ones in use are off, and holds them
  /// well enough; else transforms alone.
  [[nodiscard]] const calibration::RigSolution& sought_solution(bool last) const noexcept;
  [[nodiscard]] bool lenses_are_off(bool last) const noexcept;
  /// The solve under way is of frames that no longer count, or for another purpose than now.
  [[nodiscard]] bool outdated() const noexcept { return stale_ || sought_ != seeking_; }
  [[nodiscard]] std::optional<CalibrationDecision> judge(Stamp stamp, std::uint64_t number,
                                                         bool last) noexcept;
  [[nodiscard]] Pinhole pinhole(std::size_t c) const noexcept;
  /// Motion of the left camera since the frame watched before.
  [[nodiscard]] Transform step_to(const Transform& T_left_world) noexcept;
  /// Camera k's matches into `stereo_`; how many of them hold poses.
  int collect_stereo(const odometry::Map& map, int k, int least_found) noexcept;
  void begin_segment() noexcept;
  [[nodiscard]] double pixels_moved(const odometry::Map& map) const noexcept;
  [[nodiscard]] int expected_stereo(const odometry::Odometry& odometry, int k,
                                    const Transform& T_left_world) const noexcept;

  const EstimatorOptions& options_;
  RigCalibration rig_, nominal_;
  const RigCalibration given_;  // the drive began with
  bool calibrated_;
  bool verified_ = false, ever_verified_ = false;
  bool watched_ = true;  // frames have been watched without an outage since what is in use was
                         // confirmed
  bool found_with_lenses_ = false;
  RigCalibration learnt_{};  // what closed segments tell, with the lenses free
  bool any_learnt_ = false;
  calibration::TrackLog log_;
  calibration::RigSolver rig_solver_;
  BackgroundRunner& runner_;
  SolveTask task_;
  std::array<std::optional<calibration::Monitor>, kMaxCameras> monitors_;  // [k] of camera k ≥ 1
  std::array<std::optional<calibration::MotionTrackBuilder>, kMaxCameras> feeds_;
  std::array<std::optional<calibration::DisparityJumpDetector>, kMaxCameras> jumps_;
  BoundedVector<calibration::StereoObservation> stereo_;
  std::array<bool, kMaxCameras> learning_{};
  std::array<int, kMaxCameras> grace_{};  // frames whose verdict does not count yet
  std::array<Transform, kMaxCameras> T_camera_left_before_{};  // with the cameras unlinked
  Transform T_left_world_{};
  bool any_ = false;  // T_left_world_ is the frame before's
  bool relink_pending_ = false;

  CalibrationCause cause_ = CalibrationCause::from_scratch;
  bool seeking_ = false, solving_ = false;
  bool stale_ = false;  // the solve under way is of frames that no longer count
  std::uint64_t sought_since_ = 0, onset_ = 0;  // frame numbers
  std::size_t
      logged_ = 0,
      wanted_ = 0;  // frames logged for what is sought or learnt; and how many the next solve needs
  std::size_t solved_frames_ = 0;  // of the segment, in the newest solve
  bool change_believed_ =
      false;            // frames were left out for a change once: the rest are taken for one rig
  int rejections_ = 0;  // for other reasons than a want of frames
  int frames_since_snapshot_ = 0;
  int next_judgement_ = 0;  // frames after the snapshot at which its solution is looked at
  float waited_ms_ = 0;
  int frames_still_ = 0;              // since one was logged
  RigCalibration asked_{}, prior_{};  // of the solve under way
  bool from_rig_ = false, has_prior_ = false, sought_ = false;
  Solved solved_;
  calibration::Gate gate_ = calibration::Gate::open;
};

}  // namespace vergence
