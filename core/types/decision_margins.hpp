#pragma once

namespace vergence {

/// Statistics of the decisions on one frame, each divided by its bound: 1 or more decides. They
/// show how close an undisturbed run comes to a false alarm (build/bench/margin_bench).
struct DecisionMargins {
  /// Change of the rig, from the distances to epipolar lines: a knock or a drift.
  double change = 0;
  /// Jump of the disparities between two frames, a knock if the next frame does not revert it.
  double jump = 0;
  /// Lag of one camera by a frame.
  double lag = 0;
  /// Sigma of the motion over its usual value: `weak_geometry`.
  double uncertainty = 0;
};

}  // namespace vergence
