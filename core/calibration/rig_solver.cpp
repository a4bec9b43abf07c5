#include "core/calibration/rig_solver.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/geometry/triangulate.hpp"
#include "core/math/robust.hpp"

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
// Steps of the shared parameters at which a solve stops, in standard deviations by white noise,
// which are usually a fifth of the stated ones (inflation, calibration_bench solves): before
// outliers are removed; for the result, whose error must not increase; and for focal lengths, where
// steps are small along a flat valley. With 1, KITTI 06 does not show a focal length that is a
// quarter too long (calibration_bench focal).
constexpr double kRough = 1, kPrecise = 0.2, kFlat = 0.1;

// Maximum number of frames that a point is triangulated from.
constexpr std::size_t kMaxViews = 12;
// Initial residual in px above which an observation is of another point.
constexpr double kWildResidual = 40.0;
// Minimum number of points that connect a frame to earlier ones.
constexpr int kMinTies = 10;
// Tracks share errors that clusters by track do not capture, so clusters are image cells (kCells a
// side) and blocks of frames. kSharedErrors is the remaining ratio of the true variance of
// transforms, on recorded and rendered sequences, to that by clusters (docs/design.md).
constexpr int kCells = 6;
constexpr double kSharedErrors = 3.5;

double milliseconds_since(std::chrono::steady_clock::time_point start) noexcept {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

BundleCapacities capacities(const CalibrationOptions& options, int cameras,
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

template <class T>
BoundedVector<T> bounded(Arena& arena, std::size_t n, const char* name) {
  return BoundedVector<T>(arena.make<T>(n, name));
}

Vec2 observed_pixel(const LoggedObservation& s, std::size_t k) noexcept {
  return s.raw[k].cast<double>();
}

std::array<double, 6> sigmas(const Mat6& covariance) noexcept {
  std::array<double, 6> sigma;
  Vec6::Map(sigma.data()) = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  return sigma;
}

/// True if the poses of all cameras were found; one without a pose is placed at the left camera.
bool all_placed(const LoggedFrame& f, std::size_t cameras) noexcept {
  for (std::size_t k = 1; k < cameras; ++k)
    if (!f.T_camera_left[k].finite() || !(f.T_camera_left[k].t.norm() > 0)) return false;
  return true;
}

}  // namespace

RigSolver::RigSolver(const CalibrationOptions& options, const MonitorOptions& monitor, int cameras,
                     std::size_t features, Arena& arena)
    : options_(options),
      log_(static_cast<std::size_t>(options.max_frames), features, arena),
      adjuster_(capacities(options, cameras, features), arena),
      monitor_(monitor, arena),
      expected_scatter_px_(monitor.verified_bias_px),
      pairing_(features, arena),
      jumps_(features, arena),
      count_(static_cast<std::size_t>(cameras)) {
  const BundleCapacities c = capacities(options, cameras, features);
  poses_ = bounded<Transform>(arena, c.poses, "calibration poses");
  held_ = arena.make<std::uint8_t>(c.poses, "calibration poses");
  ties_ = arena.make<int>(c.poses + 1, "calibration poses");
  logged_ = bounded<std::uint16_t>(arena, c.poses, "calibration poses");
  points_ = bounded<Vec3>(arena, c.points, "calibration points");
  observations_ = BoundedVector<BundleObservation>(
      arena.make_unset<BundleObservation>(c.observations, "calibration observations"));
  residuals_ = arena.make<float>(c.observations, "calibration residuals");
  sorted_ = arena.make<float>(c.observations, "calibration residuals");
  references_ = bounded<Reference>(arena, c.poses * features, "calibration tracks");
  stereo_ = bounded<StereoObservation>(arena, features, "calibration matches");
}

bool RigSolver::place_cameras(const RigSolveRequest& request) noexcept {
  if (log_.empty()) return false;
  T_camera_left_ = request.rig.T_camera_left;
  if (request.from_rig) return T_camera_left_[1].t.norm() > 0;
  const LoggedFrame* best = nullptr;
  for (std::size_t i = 0; i < log_.size(); ++i) {
    const LoggedFrame& f = log_.frame(i);
    if (!f.unlinked || f.stereo < kMinTracks || !all_placed(f, count_)) continue;
    if (best == nullptr || f.reprojection_px < best->reprojection_px) best = &f;
  }
  if (best == nullptr) return false;
  // The known baseline is camera 1's; the other baselines are scaled with it.
  const double factor = request.rig.baseline / best->T_camera_left[1].t.norm();
  T_camera_left_[0] = {};
  for (std::size_t k = 1; k < count_; ++k)
    T_camera_left_[k] = {normalised(best->T_camera_left[k].R), best->T_camera_left[k].t * factor};
  return true;
}

/// Chooses every n-th frame counted back from the newest, as many as there is room for.
void RigSolver::choose_frames() noexcept {
  std::size_t observations = 0;
  for (std::size_t i = 0; i < log_.size(); ++i) observations += log_.frame(i).observations.size();
  const std::size_t step =
      1 + observations * count_ / static_cast<std::size_t>(options_.max_observations);
  poses_.clear();
  logged_.clear();
  for (std::size_t i = (log_.size() - 1) % step; i < log_.size(); i += step) {
    (void)poses_.push(log_.frame(i).T_left_world);
    (void)logged_.push(static_cast<std::uint16_t>(i));
  }
}

bool RigSolver::add_point(std::span<const Reference> track) noexcept {
  const auto observation = [&](const Reference& r) -> const LoggedObservation& {
    return log_.frame(logged_[r.frame]).observations[r.observation];
  };
  int pairs = 0;
  for (const Reference& r : track)
    pairs += (observation(r).cameras & 1U) != 0 && (observation(r).cameras & ~1U) != 0 ? 1 : 0;
  // A point must be seen in at least four images.
  if (pairs < 2 || points_.full()) return true;

  std::array<RayView, kMaxViews * kMaxCameras> views;
  std::size_t n = 0;
  const std::size_t step = (track.size() + kMaxViews - 1) / kMaxViews;
  for (std::size_t i = 0; i < track.size(); i += step) {
    const LoggedObservation& s = observation(track[i]);
    for (std::size_t k = 0; k < count_; ++k) {
      Vec3 ray;
      if (!s.by(k) || !cameras_[k].unproject(observed_pixel(s, k), &ray)) continue;
      views[n++] = {T_camera_left_[k] * poses_[track[i].frame], ray.head<2>() / ray.z(),
                    static_cast<double>(s.sigma) / cameras_[k].intrinsics().fx};
    }
  }
  const TriangulatedPoint p = triangulate(std::span(views).first(n));
  if (p.status != TriangulateStatus::ok && p.status != TriangulateStatus::no_parallax) return true;

  const std::size_t first = observations_.size();
  for (const Reference& r : track) {
    const LoggedObservation& s = observation(r);
    for (std::size_t k = 0; k < count_; ++k) {
      if (!s.by(k)) continue;
      const Vec2 seen = observed_pixel(s, k);
      Vec2 at;
      if (cameras_[k].project(T_camera_left_[k] * (poses_[r.frame] * p.p_world), &at, nullptr) !=
              ProjectStatus::ok ||
          !((at - seen).norm() < kWildResidual))
        continue;
      BundleObservation o;
      o.point = static_cast<std::uint32_t>(points_.size());
      o.pose = r.frame;
      o.camera = static_cast<std::uint8_t>(k);
      o.inverse_sigma = 1.F / s.sigma;
      o.x = seen.x();
      o.y = seen.y();
      if (!observations_.push(o)) {
        observations_.truncate(first);
        return false;
      }
    }
  }
  if (observations_.size() - first < 4)
    observations_.truncate(first);
  else
    (void)points_.push(p.p_world);
  return true;
}

void RigSolver::make_points() noexcept {
  points_.clear();
  observations_.clear();
  references_.clear();
  for (std::size_t i = 0; i < logged_.size(); ++i) {
    const LoggedFrame& f = log_.frame(logged_[i]);
    for (std::size_t j = 0; j < f.observations.size(); ++j)
      (void)references_.push(
          {f.observations[j].track, static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j)});
  }
  std::sort(references_.begin(), references_.end(), [](const Reference& a, const Reference& b) {
    return a.track != b.track ? a.track < b.track : a.frame < b.frame;
  });
  std::size_t begin = 0;
  while (begin < references_.size()) {
    std::size_t end = begin + 1;
    while (end < references_.size() && references_[end].track == references_[begin].track) ++end;
    if (!add_point(references_.span().subspan(begin, end - begin))) return;
    begin = end;
  }
}

/// Fixes the pose of each frame that hardly any track connects to earlier ones, where the map was
/// rebuilt, because nothing else would constrain it.
void RigSolver::hold_pieces() noexcept {
  // Number of points seen on both sides of a frame's beginning: +1 after the first of a point's
  // frames, −1 after the last.
  std::fill_n(ties_.begin(), poses_.size() + 1, 0);
  for (std::size_t i = 0; i < observations_.size();) {
    const BundleObservation& first = observations_[i];
    std::size_t last = i;
    while (last + 1 < observations_.size() && observations_[last + 1].point == first.point) ++last;
    ++ties_[first.pose + std::size_t{1}];
    --ties_[observations_[last].pose + std::size_t{1}];
    i = last + 1;
  }
  int ties = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    ties += ties_[i];
    held_[i] = ties < kMinTies ? 1 : 0;
  }
}

BundleOptions RigSolver::bundle_options(const RigSolveRequest& request,
                                        bool focal_lengths) const noexcept {
  // Bits of fx fy; of fx fy cx cy; and of k1 k2 p1 p2 or k1 … k4.
  constexpr std::uint16_t kFocal = 0b0011, kPinhole = 0b1111, kFourCoefficients = 0b1111'0000;
  const RigCalibration& rig = request.rig;
  const bool lenses = options_.intrinsics == IntrinsicsEstimation::full;
  BundleOptions how;
  how.configuration = BundleConfiguration::stereo_calibration;
  how.shared_errors = kSharedErrors;
  how.cells = kCells;
  how.length[1] = {BundleLength::exact, rig.baseline, 0};
  for (std::size_t k = 2; k < count_; ++k) how.length[k].kind = BundleLength::free;
  for (std::size_t k = 0; k < count_; ++k) {
    const Intrinsics& lens = (request.given != nullptr ? *request.given : rig).intrinsics[k];
    BundleIntrinsics& out = how.intrinsics[k];
    if (k > 0)
      out.free = lenses                                               ? kPinhole
                 : options_.intrinsics != IntrinsicsEstimation::fixed ? kFocal
                                                                      : std::uint16_t{0};
    if (focal_lengths) out.free = static_cast<std::uint16_t>(out.free | kFocal);
    if (lenses) out.free = static_cast<std::uint16_t>(out.free | kFourCoefficients);
    const std::array value = {lens.fx, lens.fy, lens.cx, lens.cy};
    for (std::size_t i = 0; i < 4; ++i) {
      const bool focal = i < 2;
      const double usual = focal             ? 0.01 * options_.focal_sigma_percent * value[i]
                           : lenses && k > 0 ? options_.lens_centre_sigma_px
                                             : options_.principal_point_sigma_px;
      out.prior_mean[i] = value[i];
      out.prior_sigma[i] = out.held_sigma[i] = focal && focal_lengths ? kFocalPriorSigma * value[i]
                                               : lens.sigma[i] > 0    ? lens.sigma[i]
                                                                      : usual;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const bool tangential = lens.kind == CameraModelKind::pinhole_radtan && i >= 2;
      const double given = lens.distortion_sigma[i];
      out.prior_mean[4 + i] = lens.distortion[i];
      out.prior_sigma[4 + i] = given > 0    ? given
                               : tangential ? options_.tangential_sigma
                                            : options_.distortion_sigma;
      out.held_sigma[4 + i] = given;
    }
    out.prior_mean[8] = lens.distortion[4];
    if (request.known == nullptr) continue;
    // The covariance of `known` already contains the prior.
    for (int i = 0; i < 8; ++i)
      if (request.known->covariance.known(intrinsic_row(static_cast<int>(k)) + i))
        out.prior_sigma[static_cast<std::size_t>(i)] = 0;
  }
  if (request.known != nullptr) how.shared_prior = {request.known, request.known->inflation};
  return how;
}

BundleResult RigSolver::adjust(const BundleOptions& how) noexcept {
  BundleProblem problem;
  problem.cameras = std::span(cameras_).first(count_);
  problem.T_camera_left = std::span(T_camera_left_).first(count_);
  problem.T_left_world = poses_.span();
  problem.pose_constant = held_.first(poses_.size());
  problem.points = points_.span();
  problem.observations = observations_.span();
  problem.squared_residuals = residuals_.first(observations_.size());
  return adjuster_.solve(problem, how);
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
  const std::size_t n = observations_.size();
  std::copy_n(residuals_.begin(), n, sorted_.begin());
  // The median of χ² with two degrees of freedom is 2 ln 2.
  const double scale = std::max(
      0.2, std::sqrt(0.5 * static_cast<double>(median(sorted_.first(n))) / std::numbers::ln2));
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

void RigSolver::describe(RigSolution* s) const noexcept {
  for (std::size_t i = 1; i < poses_.size(); ++i)
    s->travelled_m += (poses_[i].centre() - poses_[i - 1].centre()).norm();
  std::uint32_t last = ~0U;
  for (const BundleObservation& o : observations_) {
    if (o.point == last) continue;
    last = o.point;
    ++s->tracks;
    if ((poses_[o.pose] * points_[o.point]).z() < options_.near_baselines * s->rig.baseline)
      ++s->near;
  }
}

double RigSolver::length_noise(const BundleResult& r) const noexcept {
  if (!r.has_pose_covariance) return 0;
  std::size_t first = r.pose;
  double driven = 0;
  for (; first > 0 && held_[first] == 0; --first)
    driven += (poses_[first].centre() - poses_[first - 1].centre()).norm();
  if (!(driven > 0)) return 0;
  // This direction, like the pose's τ, is in the axes of the pose's own camera.
  const Vec3 way = (poses_[r.pose] * poses_[first].inverse()).t.normalized();
  // Variance with inverse_sigma taken as true.
  const double believed = way.dot(r.pose_covariance.bottomRightCorner<3, 3>() * way);
  // The path length depends mainly on the yaw between the cameras, so it has the yaw's inflation.
  const double white = r.covariance_white[1](1, 1), clustered = r.covariance_noise[1](1, 1);
  const double inflation = white > 0 ? std::max(1.0, clustered / white) : 1.0;
  return std::sqrt(std::max(0.0, believed * r.sigma0_squared * inflation)) / driven;
}

/// Runs the monitors of one camera over the frames used, with the result as the reference, to
/// find a camera out of sync or a change of the rig within the solve.
void RigSolver::watch_frames(std::size_t k, RigSolution* s) noexcept {
  const StereoPair pair = stereo_pair(s->rig, k);
  if (!monitor_.set_reference(pair, s->rig.covariance_total[k])) return;
  monitor_.expect_scatter(expected_scatter_px_);
  pairing_.reset();
  jumps_.set_reference(pair);
  std::uint64_t changed_at = 0;
  double offset_frames = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const LoggedFrame& f = log_.frame(logged_[i]);
    stereo_.clear();
    for (const LoggedObservation& observation : f.observations) {
      Vec3 l, r;
      if (observation.by(0) && observation.by(k) &&
          cameras_[0].unproject(observed_pixel(observation, 0), &l) &&
          cameras_[k].unproject(observed_pixel(observation, k), &r))
        (void)stereo_.push({project(pair.left, l), project(pair.camera, r),
                            static_cast<double>(observation.sigma), observation.track});
    }
    // The log contains moving frames only.
    MonitorFrame shown{.frame = f.number, .moving = true, .stereo = stereo_.span()};
    if (i > 0) shown.T_now_before = poses_[i] * poses_[i - 1].inverse();
    const MonitorResult v = monitor_.update(shown);
    offset_frames = v.offset_frames;
    pairing_.next(f.number, stereo_.span(), pair);
    if (s->lag_frames == 0) s->lag_frames = pairing_.lag_frames();
    const DisparityJump jump = jumps_.next(f.number, stereo_.span(), shown.T_now_before);
    if (jump.confirmed) changed_at = jump.onset_frame;
    if (v.kind == MonitorResult::Kind::knock) changed_at = v.onset_frame;
  }
  if (s->offset_frames == 0) s->offset_frames = offset_frames;
  // All cameras have been in place since the latest change.
  s->changed_at = std::max(s->changed_at, changed_at);
}

bool RigSolver::finish(const BundleResult& r, RigSolution* s) noexcept {
  s->status = RigSolveStatus::not_converged;
  if (!r.converged()) {
    // Report the focal length reached so far.
    if (r.usable()) s->rig.intrinsics[0] = cameras_[0].intrinsics();
    return false;
  }
  s->status = r.has_covariance ? RigSolveStatus::ok : RigSolveStatus::not_observable;
  if (!r.has_covariance) return false;
  // Scale error of the path from uncertain intrinsics: half of the relative error of the focal
  // lengths, and 0.31 % per mrad of error of the principal points.
  constexpr double kScaleByFocal = 0.5, kScaleByRadian = 3.1;
  RigCalibration& rig = s->rig;
  for (std::size_t k = 0; k < count_; ++k) {
    Intrinsics& lens = rig.intrinsics[k];
    lens = cameras_[k].intrinsics();
    // Sigmas of intrinsics that were not estimated stay.
    for (std::size_t i = 0; i < kIntrinsicsSize; ++i)
      if (const double sigma = r.intrinsics_sigma[k][i]; sigma > 0)
        (i < 4 ? lens.sigma[i] : lens.distortion_sigma[i - 4]) = sigma;
    if (k == 0) continue;
    rig.T_camera_left[k] = {normalised(T_camera_left_[k].R), T_camera_left_[k].t};
    rig.covariance_total[k] = r.covariance_total[k];
    rig.sigma_noise[k] = sigmas(r.covariance_noise[k]);
    rig.sigma_total[k] = sigmas(r.covariance_total[k]);
  }
  rig.covariance = r.covariance;
  rig.inflation = r.inflation;
  rig.frames = s->frames;
  rig.found = log_.frame(log_.size() - 1).stamp;
  rig.reprojection_px = r.rms_px;
  const double focal = options_.focal_sigma_percent * 0.01,
               centre = options_.principal_point_sigma_px / rig.intrinsics[0].fx;
  const double noise = length_noise(r);
  rig.scale_sigma = std::hypot(noise, std::hypot(kScaleByFocal * focal, kScaleByRadian * centre));
  return true;
}

RigSolution RigSolver::solve(const RigSolveRequest& request) noexcept {
  const auto start = std::chrono::steady_clock::now();
  RigSolution s{.rig = request.rig};
  for (std::size_t k = 0; k < count_; ++k) cameras_[k] = Camera(request.rig.intrinsics[k]);
  if (!place_cameras(request)) {
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
    for (std::size_t k = 1; k < count_; ++k) watch_frames(k, &s);
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
