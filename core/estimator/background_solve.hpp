#pragma once
#include "core/calibration/focal_check.hpp"
#include "core/calibration/rig_solver.hpp"
#include "core/calibration/track_log.hpp"
#include "core/estimator/estimator.hpp"

namespace vergence {

/// One solve for the rig at a time, beside the frames: takes a snapshot of the tracks, hands it to
/// the background runner, and has the solutions when that is done.
///
///     solve.start(log, start);
///     if (solve.running() && solve.next_frame()) {  // each frame
///       solve.close();
///       use(solve.solved());
///     }
///
/// Threads  One caller; the task runs where the BackgroundRunner runs it, and until it is done
/// it writes into this; the destructor waits for it. Memory from the arena at construction.
class BackgroundSolve {
 public:
  /// Where a solve begins and what is known before it.
  struct Start {
    RigCalibration rig{};
    bool from_rig = false;  // begin with the transforms of `rig`
    bool sought = false;    // a calibration is sought; false: what is in use is learnt beside it
    const RigCalibration* prior = nullptr;  // what earlier frames have shown; copied
  };
  /// The solutions of one snapshot: with the lenses as they are, and with the lenses free.
  struct Solved {
    calibration::RigSolution transforms, lenses;
  };

  /// `given`: the calibration that the drive began with.
  BackgroundSolve(const EstimatorOptions& options, const RigCalibration& given, std::size_t tracks,
                  Arena& arena, BackgroundRunner& runner);
  ~BackgroundSolve() { finish(); }
  BackgroundSolve(const BackgroundSolve&) = delete;
  BackgroundSolve& operator=(const BackgroundSolve&) = delete;
  [[nodiscard]] static std::size_t memory_needed(const EstimatorOptions& options, int cameras,
                                                 std::size_t tracks) noexcept;

  /// Precondition: !running().
  void start(const calibration::TrackLog& log, const Start& start) noexcept;
  /// From start() to close().
  [[nodiscard]] bool running() const noexcept { return running_; }
  [[nodiscard]] bool sought() const noexcept { return start_.sought; }
  /// Once a frame while it runs. True: it is done, and its turn has come. In a live drive that is
  /// never waited for (Adoption::when_ready); else it is.
  [[nodiscard]] bool next_frame() noexcept;
  /// Its last turn: it is adopted or rejected.
  [[nodiscard]] bool last_turn() const noexcept;
  /// The next turn is some frames later.
  void postpone() noexcept;
  /// How long the last next_frame() waited for the solver: with Adoption::after_fixed_frames only,
  /// a live drive never does.
  [[nodiscard]] float waited_ms() const noexcept { return waited_ms_; }
  void clear_waited() noexcept { waited_ms_ = 0; }
  /// Waits for the task.
  void finish() noexcept;
  /// What the solve under way finds is of no use: its frames no longer count.
  void discard() noexcept { discarded_ = running_; }
  /// It is discarded, or for another purpose than now.
  [[nodiscard]] bool outdated(bool seeking) const noexcept {
    return discarded_ || start_.sought != seeking;
  }
  /// The solutions have been looked at; another solve may start.
  void close() noexcept { running_ = false; }
  [[nodiscard]] const Solved& solved() const noexcept { return solved_; }
  /// Measures with the same snapshots; while no solve runs.
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
  Start start_;
  RigCalibration prior_{};
  Solved solved_;
  bool running_ = false, discarded_ = false;
  int frames_since_start_ = 0;
  int next_turn_ = 0;  // frames after the start
  float waited_ms_ = 0;
};

}  // namespace vergence
