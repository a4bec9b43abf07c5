#include "core/calibration/segment_solver.hpp"

#include <algorithm>

#include "core/calibration/posterior.hpp"

namespace vergence::calibration {

SegmentSolver::SegmentSolver(Kind kind, const RigCalibration& given, const RigCalibration& start,
                             std::size_t frames, const CalibrationOptions& options,
                             const MonitorOptions& monitor, std::size_t features, Arena& arena)
    : kind_(kind),
      options_(options),
      given_(given),
      start_(start),
      frames_(std::clamp(frames, static_cast<std::size_t>(options.min_frames),
                         static_cast<std::size_t>(options.max_frames))),
      solver_(options_, monitor, given.cameras, features, arena) {}

std::optional<RigSolution> SegmentSolver::add(const TrackLog& tracks) noexcept {
  std::optional<RigSolution> solved;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const LoggedFrame& f = tracks.frame(i);
    if (f.number < next_) continue;
    next_ = f.number + 1;
    ++taken_;
    solver_.log().append(f);
    if (solver_.log().size() == frames_) solved = solve();
  }
  return solved;
}

std::optional<RigSolution> SegmentSolver::end() noexcept {
  if (solver_.log().size() < static_cast<std::size_t>(options_.min_frames)) return std::nullopt;
  return solve();
}

std::optional<RigSolution> SegmentSolver::solve() noexcept {
  RigSolveRequest request{.rig = start_, .from_rig = true, .given = &given_};
  // Drift is applied to a copy, because a failed solve must not age the prior.
  std::optional<RigCalibration> known = known_;
  if (known) {
    const Stamp newest = solver_.log().frame(solver_.log().size() - 1).stamp;
    let_drift((newest - known->found).to_seconds() / 3600.0, options_, &*known);
    request.known = &*known;
  }
  RigSolution s = solver_.solve(request);
  solver_.log().clear();
  if (s.status == RigSolveStatus::ok && kind_ == Kind::joined) {
    start_ = s.rig;
    known_ = s.rig;
  }
  return s;
}

}  // namespace vergence::calibration
