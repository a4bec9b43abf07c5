#include "core/calibration/focal_check.hpp"

#include <cmath>

#include "core/math/robust.hpp"

namespace vergence::calibration {
namespace {

// Systematic error of the measured focal length, relative: at most 3.2 % on recorded sequences
// after 25 frames (docs/calibration.md).
constexpr double kSystematic = 0.04;

}  // namespace

FocalMeasurement check_focal_length(const RigSolution& found,
                                    const RigCalibration& given) noexcept {
  FocalMeasurement m;
  m.configured_px = given.intrinsics[0].fx;
  const Intrinsics& lens = found.rig.intrinsics[0];
  if (!(m.configured_px > 0)) return m;
  const double off = std::abs(lens.fx / m.configured_px - 1);
  if (found.status == RigSolveStatus::not_converged && off > kFocalPriorSigma) {
    // The solve has not converged but is already far off, and the true value is farther.
    m.measured_px = lens.fx;
    m.contradicted = m.doubted = true;
  } else if (found.status == RigSolveStatus::ok && lens.sigma[0] > 0) {
    m.measured_px = lens.fx;
    m.sigma_px = std::hypot(lens.sigma[0], kSystematic * lens.fx);
    const double noise = lens.sigma[0] / lens.fx;
    m.contradicted = off > kSystematic + kCertainSigmas * noise;
    m.doubted = m.contradicted || log_odds(off, noise, kSystematic, kFocalPriorSigma) < 0;
  }
  return m;
}

void FocalCheck::measure(RigSolver& solver, const RigSolveRequest& request,
                         const RigSolution& solved) noexcept {
  solved_ = {};
  solve_ms_ = 0;
  if (!enabled_ || known_ || solved.status != RigSolveStatus::ok || request.given == nullptr)
    return;
  const RigSolution found = solver.free_focal_lengths(request);
  solved_ = check_focal_length(found, *request.given);
  solve_ms_ = found.solve_ms;
}

void FocalCheck::accept(bool full) noexcept {
  if (solved_.measured_px <= 0) return;
  newest_ = solved_;
  known_ = full && !newest_.doubted;
}

}  // namespace vergence::calibration
