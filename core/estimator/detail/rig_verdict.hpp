#pragma once
#include "core/calibration/disparity_jump.hpp"
#include "core/calibration/monitor.hpp"

namespace vergence {

/// What a frame says of the rig, from what it says of each further camera: the worst of the
/// verdicts, doubts about any one of them, and `in_step` and `shows_no_lag` only of all.
///
/// Threads: a value.
class RigVerdict {
 public:
  /// One further camera: its monitor's verdict, and whether its disparities jumped, which a monitor
  /// does not see. One without enough matches says nothing of the cameras' step.
  void add(calibration::MonitorVerdict v, const calibration::DisparityJump& jump) noexcept {
    if (!v.needs_texture) {
      any_measures_ = true;
      in_step_ = in_step_ && v.in_step;
      no_lag_ = no_lag_ && v.shows_no_lag;
    }
    if (jump.confirmed && rank(v.kind) < rank(Kind::knock)) {
      v.kind = Kind::knock;
      v.onset_frame = jump.onset_frame;
    }
    undecided_ = undecided_ || v.undecided || jump.suspected;
    if (rank(v.kind) > rank(worst_.kind) ||
        (rank(v.kind) == rank(worst_.kind) && v.statistic > worst_.statistic))
      worst_ = v;
  }
  /// One of which only jumps count.
  void add(const calibration::DisparityJump& jump) noexcept {
    undecided_ = undecided_ || jump.suspected;
    if (!jump.confirmed) return;
    worst_.kind = Kind::knock;
    worst_.onset_frame = jump.onset_frame;
  }

  [[nodiscard]] calibration::MonitorVerdict of_all() const noexcept {
    calibration::MonitorVerdict v = worst_;
    v.undecided = undecided_;
    v.in_step = any_measures_ && in_step_;
    v.shows_no_lag = any_measures_ && no_lag_;
    return v;
  }

 private:
  using Kind = calibration::MonitorVerdict::Kind;
  static int rank(Kind kind) noexcept {
    switch (kind) {
      case Kind::quiet:
        return 0;
      case Kind::out_of_step:
        return 1;
      case Kind::drift:
        return 2;
      case Kind::knock:
        return 3;
      case Kind::collapse:
        return 4;
    }
    return 0;
  }

  calibration::MonitorVerdict worst_;
  bool in_step_ = true, no_lag_ = true, undecided_ = false, any_measures_ = false;
};

}  // namespace vergence
