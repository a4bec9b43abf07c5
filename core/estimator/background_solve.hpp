#pragma once
#include "core/calibration/focal_check.hpp"
#include "core/calibration/rig_solver.hpp"
#include "core/calibration/track_log.hpp"
#include "core/estimator/estimator.hpp"

namespace vergence {

/// Runs one rig calibration at a time in the background: copies the tracks, hands them to the
/// background runner and provides the solution once the runner has finished.
///
///     solve.start(log, request);
///     if (solve.running() && solve.next_frame()) {  // each frame
///       solve.close();
///       evaluate(solve.solved());
///     }
///
/// Threads  One caller. The task runs on the BackgroundRunner's thread and writes into this object
///          until it is done; the destructor waits for it. Memory from the arena at construction.
class BackgroundSolve {
 public:
  /// Initial values, mode and prior of a solve.
  struct Request {
    RigCalibration rig{};
    /// True: estimate a new calibration. False: refine the one in use, from its transforms.
    bool for_new_rig = false;
    /// Posterior of earlier frames, copied by start(); null if there is none.
    const RigCalibration* prior = nullptr;
  };
  /// `given`: initial calibration; its intrinsics are the prior of every solve.
  BackgroundSolve(const EstimatorOptions& options, const RigCalibration& given, std::size_t tracks,
                  Arena& arena, BackgroundRunner& runner);
  ~BackgroundSolve() { finish(); }
  BackgroundSolve(const BackgroundSolve&) = delete;
  BackgroundSolve& operator=(const BackgroundSolve&) = delete;

  /// Precondition: !running().
  void start(const calibration::TrackLog& log, const Request& request) noexcept;
  [[nodiscard]] bool running() const noexcept { return running_; }
  [[nodiscard]] bool for_new_rig() const noexcept { return request_.for_new_rig; }
  /// Call once per frame while running(). Returns true if the solver has finished and a decision is
  /// due. Waits for the solver with Adoption::after_fixed_frames only.
  [[nodiscard]] bool next_frame() noexcept;
  /// Returns true if the decision cannot be postponed: the solution must be adopted or rejected.
  [[nodiscard]] bool must_decide() const noexcept;
  /// Postpones the decision, so that more frames are held out of the solve.
  void postpone() noexcept;
  /// Time that the last next_frame() waited for the solver, in ms; 0 with Adoption::when_ready.
  [[nodiscard]] float waited_ms() const noexcept { return waited_ms_; }
  void clear_waited() noexcept { waited_ms_ = 0; }
  void finish() noexcept;
  /// Marks a running solve as outdated, because its frames no longer describe the rig.
  void discard() noexcept { discarded_ = running_; }
  /// Returns true if the solve was discarded or does not match the present mode. `estimating`: a
  /// new calibration is estimated, not a refinement.
  [[nodiscard]] bool outdated(bool estimating) const noexcept {
    return discarded_ || request_.for_new_rig != estimating;
  }
  /// Ends the solve after its solution was evaluated; another one may start.
  void close() noexcept { running_ = false; }
  [[nodiscard]] const calibration::RigSolution& solved() const noexcept { return solved_; }
  /// Focal lengths measured from the same snapshots. Access it only while no solve is running.
  [[nodiscard]] calibration::FocalCheck& focal_check() noexcept { return focal_check_; }
  [[nodiscard]] const calibration::FocalCheck& focal_check() const noexcept { return focal_check_; }

 private:
  struct Task {
    BackgroundSolve* solve;
    void operator()() const noexcept { solve->run(); }
  };
  void run() noexcept;

  const EstimatorOptions& options_;
  const RigCalibration given_;
  calibration::RigSolver solver_;
  calibration::FocalCheck focal_check_;
  BackgroundRunner& runner_;
  Task task_;
  Request request_;
  RigCalibration prior_{};
  calibration::RigSolution solved_;
  bool running_ = false, discarded_ = false;
  int frames_since_start_ = 0;
  // Number of frames after start() at which the next decision is due.
  int next_decision_ = 0;
  float waited_ms_ = 0;
};

}  // namespace vergence
