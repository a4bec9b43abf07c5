#include "core/calibration/rig_solver.hpp"
#include "core/math/robust.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

namespace vergence::calibration {
namespace {

// Minimum average number of frames per track, which determines the capacity for points.
constexpr std::size_t kFramesATrack = 3;
// Minimum average number of used lanes of a block's eight, which determines the capacity for
// blocks; recorded sequences use 4.9 to 7.0.
constexpr std::size_t kLanesABlock = 2;
// Minimum number of points of a solve, and of stereo matches of the frame whose transform
// initialises it.
constexpr int kMinTracks = 40;
// Threshold of both losses, in residual scales.
constexpr double kLossThreshold = 2.5;
// Maximum number of steps of the last adjustment; a focal length with an error of a quarter takes
// more than a hundred.
constexpr int kMaxSteps = 200;
// Last steps of the shared parameters, in standard deviations by white noise, which are a fifth of
// the stated ones: before outliers are removed; of the result, whose error it is not to increase;
// and of a focal length, whose error lies along a flat valley with small steps.
constexpr double kRough = 1, kPrecise = 0.2, kFlat = 0.1;

double milliseconds_since(std::chrono::steady_clock::time_point start) noexcept {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

/// True if the poses of all cameras were found; one without a pose is placed at the left camera.
bool all_placed(const LoggedFrame& f, int cameras) noexcept {
  for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k)
    if (!f.T_camera_left[k].finite() || !(f.T_camera_left[k].t.norm() > 0)) return false;
  return true;
}

}  // namespace

BundleCapacities RigSolver::capacities(const CalibrationOptions& options, int cameras,
                                       std::size_t features) noexcept {
  BundleCapacities c;
  c.cameras = static_cast<std::size_t>(cameras);
  c.poses = static_cast<std::size_t>(options.max_frames);
  c.observations =
      std::min(static_cast<std::size_t>(options.max_observations), c.poses * features * c.cameras);
  c.points = c.observations / (kFramesATrack * c.cameras);
  c.blocks = c.observations / (kLanesABlock * c.cameras);
  c.shared = true;
  return c;
}

RigSolver::RigSolver(const CalibrationOptions& options, const MonitorOptions& monitor, int cameras,
                     std::size_t features, Arena& arena)
    : options_(options),
      log_(static_cast<std::size_t>(options.max_frames), features, arena),
      adjuster_(capacities(options, cameras, features), arena),
      monitor_(monitor, arena),
      expected_scatter_px_(monitor.verified_bias_px),
      pairing_(features, arena),
      jumps_(features, arena),
      max_frames_(static_cast<std::size_t>(options.max_frames)),
      count_(cameras) {
  const BundleCapacities c = capacities(options, cameras, features);
  poses_ = BoundedVector<Transform>(arena.make<Transform>(c.poses, "calibration poses"));
  held_ = BoundedVector<std::uint8_t>(arena.make<std::uint8_t>(c.poses, "calibration poses"));
  ties_ = arena.make<int>(c.poses + 1, "calibration poses");
  logged_ = BoundedVector<std::uint16_t>(arena.make<std::uint16_t>(c.poses, "calibration poses"));
  points_ = BoundedVector<Vec3>(arena.make<Vec3>(c.points, "calibration points"));
  observations_ = BoundedVector<BundleObservation>(
      arena.make_unset<BundleObservation>(c.observations, "calibration observations"));
  residuals_ = arena.make<float>(c.observations, "calibration residuals");
  sorted_ = arena.make<float>(c.observations, "calibration residuals");
  references_ =
      BoundedVector<Reference>(arena.make<Reference>(max_frames_ * features, "calibration tracks"));
  stereo_ = BoundedVector<StereoObservation>(
      arena.make<StereoObservation>(features, "calibration matches"));
}

bool RigSolver::choose_candidate(const RigCalibration& rig) noexcept {
  const LoggedFrame* best = nullptr;
  for (std::size_t i = 0; i < log_.size(); ++i) {
    const LoggedFrame& f = log_.frame(i);
    if (!f.unlinked || f.stereo < kMinTracks || !all_placed(f, count_)) continue;
    if (best == nullptr || f.reprojection_px < best->reprojection_px) best = &f;
  }
  if (best == nullptr) return false;
  for (int k = 1; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    T_camera_left_[c] = best->T_camera_left[c];
    T_camera_left_[c].R = normalised(T_camera_left_[c].R);
  }
  // The known baseline is camera 1's; the other baselines are scaled with it.
  const double factor = rig.baseline / T_camera_left_[1].t.norm();
  for (int k = 1; k < count_; ++k) T_camera_left_[static_cast<std::size_t>(k)].t *= factor;
  T_camera_left_[0] = {};
  return true;
}

bool RigSolver::begin_with(const RigSolveRequest& request) noexcept {
  if (log_.empty()) return false;
  if (!request.from_rig) return choose_candidate(request.rig);
  T_camera_left_ = request.rig.T_camera_left;
  return T_camera_left_[1].t.norm() > 0;
}

/// Chooses every n-th frame counted back from the newest, as many as there is room for.
void RigSolver::choose_frames() noexcept {
  std::size_t observations = 0;
  for (std::size_t i = 0; i < log_.size(); ++i) observations += log_.frame(i).observations.size();
  const std::size_t step = 1 + observations * static_cast<std::size_t>(count_) /
                                   static_cast<std::size_t>(options_.max_observations);
  poses_.clear();
  logged_.clear();
  for (std::size_t i = (log_.size() - 1) % step; i < log_.size(); i += step) {
    (void)poses_.push(log_.frame(i).T_left_world);
    (void)logged_.push(static_cast<std::uint16_t>(i));
  }
}

BundleResult RigSolver::adjust(const BundleOptions& how) noexcept {
  const auto n = static_cast<std::size_t>(count_);
  BundleProblem problem;
  problem.cameras = std::span(cameras_).first(n);
  problem.T_camera_left = std::span(T_camera_left_).first(n);
  problem.T_left_world = poses_.span();
  problem.pose_constant = held_.span();
  problem.points = points_.span();
  problem.observations = observations_.span();
  problem.squared_residuals = residuals_.first(observations_.size());
  return adjuster_.solve(problem, how);
}

double RigSolver::residual_scale() noexcept {
  const std::size_t n = observations_.size();
  std::copy_n(residuals_.begin(), n, sorted_.begin());
  // The median of χ² with two degrees of freedom is 2 ln 2.
  return std::max(
      0.2, std::sqrt(0.5 * static_cast<double>(median(sorted_.first(n))) / std::numbers::ln2));
}

void RigSolver::drop_outliers(double limit) noexcept {
  std::size_t kept = 0, begin = 0;
  while (begin < observations_.size()) {
    const std::uint32_t point = observations_[begin].point;
    const std::size_t first = kept;
    std::size_t i = begin;
    for (; i < observations_.size() && observations_[i].point == point; ++i)
      if (static_cast<double>(residuals_[i]) < limit * limit)
        observations_[kept++] = observations_[i];
    // A point must keep three observations from at least two cameras, to be determined and to
    // constrain the rig.
    unsigned cameras = 0;
    for (std::size_t j = first; j < kept; ++j) cameras |= 1U << observations_[j].camera;
    if (kept - first < 3 || (cameras & (cameras - 1U)) == 0) kept = first;
    begin = i;
  }
  observations_.truncate(kept);
}

BundleResult RigSolver::readjust(BundleOptions how, bool last, double tolerance_sigmas) noexcept {
  const double scale = residual_scale();
  drop_outliers(kOutlierSigmas * scale);
  how.loss = BundleLoss::cauchy;
  how.loss_threshold = kLossThreshold * scale;
  how.max_steps = last ? kMaxSteps : 8;
  how.tolerance_sigmas = tolerance_sigmas;
  how.covariance = how.pose_covariance = last;
  return adjust(how);
}

/// Solves with Huber's loss, then twice with Cauchy's after removing outliers.
BundleResult RigSolver::adjust_robustly(BundleOptions how) noexcept {
  how.loss = BundleLoss::huber;
  how.loss_threshold = kLossThreshold;
  how.max_steps = 12;
  how.tolerance_sigmas = kRough;
  BundleResult r = adjust(how);
  for (const bool last : {false, true}) {
    if (!r.usable()) return r;
    r = readjust(how, last, last ? kPrecise : kRough);
  }
  return r;
}

bool RigSolver::finish(const BundleResult& r, RigSolution* s) noexcept {
  s->status = RigSolveStatus::not_converged;
  if (!r.converged()) {
    // Report the focal length reached so far.
    if (r.usable()) s->rig.intrinsics[0] = cameras_[0].intrinsics();
    return false;
  }
  s->status = r.has_covariance ? RigSolveStatus::ok : RigSolveStatus::not_observable;
  if (s->status == RigSolveStatus::ok) write_result(r, s);
  return s->status == RigSolveStatus::ok;
}

RigSolution RigSolver::solve(const RigSolveRequest& request) noexcept {
  const auto start = std::chrono::steady_clock::now();
  RigSolution s{.rig = request.rig};
  for (int k = 0; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    cameras_[c] = Camera(request.rig.intrinsics[c]);
  }
  if (!begin_with(request)) {
    s.status = RigSolveStatus::no_candidate;
    return s;
  }
  choose_frames();
  s.frames = static_cast<int>(poses_.size());
  s.newest = log_.frame(log_.size() - 1).number;
  make_points();
  if (points_.size() < static_cast<std::size_t>(kMinTracks)) return s;
  hold_pieces();
  const BundleResult r = adjust_robustly(bundle_options(request, false));
  if (r.converged()) describe(&s);
  if (finish(r, &s)) {
    // Limit the sum, which grows over months.
    if (request.known != nullptr)
      s.rig.frames += std::min(request.known->frames, std::numeric_limits<int>::max() / 2);
    watch_frames(&s);
  }
  s.solve_ms = milliseconds_since(start);
  return s;
}

RigSolution RigSolver::free_focal_lengths(RigSolveRequest request) noexcept {
  const auto start = std::chrono::steady_clock::now();
  RigSolution s{.rig = request.rig};
  request.known = nullptr;
  (void)finish(readjust(bundle_options(request, true), true, kFlat), &s);
  s.solve_ms = milliseconds_since(start);
  return s;
}

}  // namespace vergence::calibration
