#include "core/calibration/gates.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/calibration/health.hpp"
#include "core/camera/camera.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/math/angle.hpp"
#include "core/math/robust.hpp"
#include "core/math/so3.hpp"
#include "core/memory/fixed_vector.hpp"

namespace vergence::calibration {
namespace {

// Sigmas in rad of the rotation error that no epipolar line shows: of a calibration of this rig
// without sigmas, and of a calibration of another rig. With the first, every published calibration
// of the seven recorded sequences is verified (robustness_bench drives); the second is the size of
// a mounting error.
constexpr double kSuppliedYaw = 1e-3, kOtherYaw = 15e-3;
// Prior probability that a supplied calibration is not the rig's, and rate of wrong decisions about
// it; both are chosen.
constexpr double kOtherBefore = 0.02, kErrorRate = 0.01;
// Minimum path length of a solve, in baselines.
constexpr double kMinBaselinesTravelled = 3.0;
// Systematic error of the measured focal length, relative: at most 3.2 % on recorded sequences
// after 25 frames (docs/calibration.md).
constexpr double kSystematicFocal = 0.04;

/// Median distance in px of one frame's matches between the left camera and camera k to the
/// epipolar lines; negative if there are too few.
double median_distance(const LoggedFrame& frame, const RigCalibration& rig, int k) noexcept {
  const auto other = static_cast<std::size_t>(k);
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[other]);
  const EpipolarGeometry geometry(rig.T_camera_left[other]);
  std::array<double, kHeldOutMatches> distance;
  std::size_t n = 0;
  const std::size_t step = frame.observations.size() / kHeldOutMatches + 1;
  for (std::size_t i = 0; i < frame.observations.size() && n < distance.size(); i += step) {
    const LoggedObservation& s = frame.observations[i];
    Vec3 a, b;
    double d = 0;
    if (!s.by(0) || !s.by(other) || !left.unproject(s.raw[0].cast<double>(), &a) ||
        !right.unproject(s.raw[other].cast<double>(), &b) ||
        !geometry.to_line(a.head<2>() / a.z(), b.head<2>() / b.z(), &d, nullptr))
      continue;
    distance[n++] = std::abs(d) * rig.intrinsics[other].fx;
  }
  if (n < 10) return -1.0;
  return median(std::span(distance).first(n));
}

/// At most the newest kHeldOutFrames frames whose number is above `after` and at most `last`, the
/// newest one first.
FixedVector<const LoggedFrame*, kHeldOutFrames> newest_frames(
    const TrackLog& log, std::uint64_t after, std::uint64_t last = ~std::uint64_t{0}) noexcept {
  FixedVector<const LoggedFrame*, kHeldOutFrames> frames;
  for (std::size_t i = log.size(); i-- > 0 && !frames.full() && log.frame(i).number > after;)
    if (log.frame(i).number <= last) (void)frames.push(&log.frame(i));
  return frames;
}

/// Fit of camera k on these frames.
HeldOut fit_on(const FixedVector<const LoggedFrame*, kHeldOutFrames>& frames,
               const RigCalibration& rig, int k) noexcept {
  FixedVector<double, kHeldOutFrames> medians;
  for (const LoggedFrame* f : frames)
    if (const double m = median_distance(*f, rig, k); m >= 0) (void)medians.push(m);
  return {static_cast<int>(medians.size()), medians.empty() ? 0 : median(medians.span())};
}

/// Returns true if held-out frames contradict any camera of `rig`, compared with the fit of
/// `solved` on its own frames.
bool misfits(const TrackLog& log, std::uint64_t newest, const RigCalibration& solved,
             const RigCalibration& rig, double pixel_sigma) noexcept {
  for (int k = 1; k < solved.cameras; ++k) {
    const HeldOut fit = fit_on(newest_frames(log, newest), rig, k);
    if (fit.frames < kMinForMean) continue;
    const double used = fit_on(newest_frames(log, 0, newest), solved, k).median_px;
    if (fit.median_px > kUnusualRatio * std::min(std::max(used, pixel_sigma), kMaxFitPx))
      return true;
  }
  return false;
}

/// Sigma of the relative depth of a calibration that is the rig's, in percent.
double current_percent(const RigCalibration& current, int k, double depth,
                       const CalibrationOptions& o) noexcept {
  const double own = depth_error_percent(current, k, depth);
  const double by_turn = 100 * depth / current.T_camera_left[static_cast<std::size_t>(k)].t.norm();
  // A rotation by σ is a disparity of f σ, and so a relative depth error of z σ / b.
  return own > 0 ? std::hypot(own, 1e-3 * o.extrinsic_random_walk_mrad_per_sqrt_h * by_turn)
                 : kSuppliedYaw * by_turn;
}

}  // namespace

HeldOut held_out(const TrackLog& log, std::uint64_t after, const RigCalibration& rig) noexcept {
  HeldOut worst;
  for (int k = 1; k < rig.cameras; ++k) {
    const HeldOut fit = fit_on(newest_frames(log, after), rig, k);
    if (k == 1 || fit.median_px > worst.median_px) worst = fit;
  }
  return worst;
}

bool held_out_enough(const TrackLog& log, std::uint64_t after) noexcept {
  return newest_frames(log, after).size() >= static_cast<std::size_t>(kMinForMean);
}

bool fits_better(const TrackLog& log, std::uint64_t after, const RigCalibration& better,
                 const RigCalibration& worse, double chance) noexcept {
  double sum = 0, squares = 0;
  int n = 0;
  for (const LoggedFrame* f : newest_frames(log, after)) {
    double gain = 0;
    bool compared = false;
    for (int k = 1; k < better.cameras; ++k) {
      const double a = median_distance(*f, worse, k), b = median_distance(*f, better, k);
      // A calibration without enough matches in this frame cannot be compared.
      if (a < 0 || b < 0) continue;
      gain += a - b;
      compared = true;
    }
    if (!compared) continue;
    sum += gain;
    squares += gain * gain;
    ++n;
  }
  if (n < kMinForMean) return true;
  const double mean = sum / n, variance = std::max(0.0, squares / n - mean * mean);
  return mean > chance * std::sqrt(variance / (n - 1));
}

Assessment assess(const RigCalibration& measured, const RigCalibration& current,
                  CalibrationOrigin source, const TrackLog& log, std::uint64_t after,
                  const CalibrationOptions& o, double pixel_sigma) noexcept {
  const double before = std::log(kOtherBefore / (1 - kOtherBefore)),
               certain = std::log((1 - kErrorRate) / kErrorRate);
  Assessment a;
  a.verified = true;
  // True if every camera's depth is determined better than by the calibration in use.
  bool sharper = true;
  double worst = 0;
  for (int k = 1; k < measured.cameras; ++k) {
    const double depth = reference_depth_m(measured, k, o, pixel_sigma);
    const double s = depth_error_percent(measured, k, depth),
                 difference = depth_error_percent(measured, current, k, depth);
    const double by_turn =
        100 * depth / measured.T_camera_left[static_cast<std::size_t>(k)].t.norm();
    const double m = current_percent(current, k, depth, o);
    const double odds = log_odds(difference, s, m, kOtherYaw * by_turn);
    const double certainty = (odds - before) / certain;
    // If the rig is that of the calibration in use, the best estimate of its depth error is the
    // weighted mean of both.
    const double weight = source == CalibrationOrigin::this_drive ? 1.0 : m * m / (m * m + s * s);
    const double off = std::hypot(weight * difference, std::sqrt(weight) * s);
    a.verified = a.verified && s > 0 && certainty > 1 && off <= o.max_depth_error_percent;
    const bool contradicted = difference > o.max_depth_error_percent && certainty < -1;
    const double limit = source == CalibrationOrigin::this_drive ? m : m / kUnusualRatio;
    sharper = sharper && s < limit;
    a.nearer = a.nearer || (s < limit && difference > kChance * s);
    // Evidence against one camera takes precedence over missing evidence for another.
    if (k > 1 && (contradicted == a.contradicted ? off <= worst : a.contradicted)) continue;
    worst = off;
    a.contradicted = contradicted;
    a.log_odds = odds;
    a.certainty = certainty;
    a.depth_m = depth;
    a.sigma_percent = s;
    a.difference_percent = difference;
    const double turn = difference / by_turn;
    a.evidence = {std::abs(odds), turn * measured.intrinsics[static_cast<std::size_t>(k)].fx,
                  1e3 * turn};
  }
  a.worse = fits_better(log, after, current, measured);
  // In a full window a misfit to the epipolar lines cannot be due to the position of the structure.
  const bool lines = misfits(log, after, measured, current, pixel_sigma) ||
                     (sharper && measured.frames >= o.max_frames);
  a.better = (a.nearer && !a.worse) ||
             (lines && fits_better(log, after, measured, current, kCertainSigmas));
  return a;
}

const char* reason(Gate gate) noexcept {
  // In the order of Gate.
  static constexpr std::array kReasons = {
      "",
      "the adjustment did not converge",
      "the distance travelled is too short",
      "too few points are near enough to determine the depth",
      "the right camera is on the left: its cable or its order in the configuration is swapped",
      "the direction between the cameras is far from the configured one",
      "the rotation between the cameras is far from the configured one",
      "the cameras' images are not from the same instant",
      "held-out frames do not fit it",
      "the calibration in use fits as well",
      "the rig changed during the frames of the solve",
      "the tracks do not determine the depth well enough yet"};
  static_assert(kReasons.size() == static_cast<std::size_t>(Gate::depth_unknown) + 1);
  return kReasons[static_cast<std::size_t>(gate)];
}

double depth_excess(const RigCalibration& rig, const CalibrationOptions& o,
                    double pixel_sigma) noexcept {
  RigCalibration used = rig;
  // No number of frames reduces the uncertainty of intrinsics that are fixed.
  if (o.intrinsics != IntrinsicsEstimation::full) {
    used.covariance = {};
    for (Mat6& C : used.covariance_total) C.setZero();
    used.sigma_total = used.sigma_noise;
  }
  double worst = 0;
  for (int k = 1; k < rig.cameras; ++k)
    worst =
        std::max(worst, depth_error_percent(used, k, reference_depth_m(rig, k, o, pixel_sigma)));
  return worst / o.usable_depth_percent;
}

Gate check_acceptance(const AcceptanceInput& q, const CalibrationOptions& o) noexcept {
  const RigSolution& s = *q.solution;
  if (s.status != RigSolveStatus::ok) return Gate::not_solved;
  for (int k = 1; k < s.rig.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const Transform &found = s.rig.T_camera_left[c], &nominal = q.nominal->T_camera_left[c];
    if (found.t.dot(nominal.t) < 0) return Gate::cameras_swapped;
    if (s.lag_frames != 0) return Gate::out_of_sync;
    if (q.may_have_changed && s.changed_at > 0) return Gate::rig_changed;
    if (angle_between(found.t, nominal.t) > o.max_direction_deg * kRadiansPerDegree)
      return Gate::implausible_direction;
    if (q.in_use != nullptr &&
        log_so3(found.R * nominal.R.transpose()).norm() > o.max_rotation_deg * kRadiansPerDegree)
      return Gate::implausible_rotation;
  }
  if (s.travelled_m < kMinBaselinesTravelled * s.rig.baseline) return Gate::needs_motion;
  if (s.near < o.min_near_points) return Gate::needs_near_structure;
  if (depth_excess(s.rig, o, q.pixel_sigma) > 1) return Gate::depth_unknown;

  // The gates below need frames that are not in the solve.
  if (q.log == nullptr) return Gate::open;
  if (misfits(*q.log, s.newest, s.rig, s.rig, q.pixel_sigma)) return Gate::does_not_fit;
  if (q.in_use == nullptr || !q.must_be_better || fits_better(*q.log, s.newest, s.rig, *q.in_use))
    return Gate::open;
  // A yaw changes depths, but hardly the distances to epipolar lines that are compared above.
  const Assessment a = assess(s.rig, *q.in_use, q.source, *q.log, s.newest, o, q.pixel_sigma);
  return (a.nearer || a.log_odds < 0) && !a.worse ? Gate::open : Gate::no_better;
}

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
    m.sigma_px = std::hypot(lens.sigma[0], kSystematicFocal * lens.fx);
    const double noise = lens.sigma[0] / lens.fx;
    m.contradicted = off > kSystematicFocal + kCertainSigmas * noise;
    m.doubted = m.contradicted || log_odds(off, noise, kSystematicFocal, kFocalPriorSigma) < 0;
  }
  return m;
}

}  // namespace vergence::calibration
