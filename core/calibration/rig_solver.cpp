#include "core/calibration/rig_solver.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/geometry/triangulate.hpp"

namespace vergence::calibration {
namespace {

constexpr std::size_t kFramesATrack = 3;  // at least, on average: sizes the points
constexpr std::size_t kLanesABlock = 2;   // of the eight, at least, on average: sizes the blocks;
                                          // recorded drives fill 4.9 to 7.0
constexpr std::size_t kMostViews = 12;    // of a track that its point is triangulated from
constexpr double kWildResidual = 40.0;    // px at the start: not the same point
constexpr double kCertainChange =
    2;  // of the monitor's threshold: the frames have been used to find what they are held against
constexpr int kLeastTracks = 60;
constexpr int kLeastTies = 10;  // points that tie a frame to those before it
constexpr int kLeastCandidateMatches =
    40;  // across, of the frame whose own transform begins the solve
constexpr double kHuber = 2.0, kCauchy = 2.5;  // residual scales
constexpr double kFirstCut = 6.0,
                 kLastCut = 4.0;  // residual scales beyond which a observation is left out
// Tracks share errors that a cluster a track does not see: clusters are cells of the image and
// blocks of frames. What is left, variance of the transforms found on recorded and rendered drives
// over the one by clusters (docs/calibration.md).
constexpr int kCells = 6;
constexpr double kSharedErrors = 3.5;
constexpr double kUsualInflation = 6;    // of a calibration that does not say its own
constexpr double kMedianOfTwo = 1.1774;  // median length of a vector of two standard normal numbers

double milliseconds_since(std::chrono::steady_clock::time_point start) noexcept {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

/// A lens with the sigmas of what was estimated; of the rest it keeps its own.
Intrinsics with_sigmas(Intrinsics lens, const std::array<double, kIntrinsicsSize>& sigma) noexcept {
  for (std::size_t i = 0; i < sigma.size(); ++i)
    if (sigma[i] > 0) (i < 4 ? lens.sigma[i] : lens.distortion_sigma[i - 4]) = sigma[i];
  return lens;
}

Vec2 pixel_of(const LoggedObservation& s, int k) noexcept {
  return s.raw[static_cast<std::size_t>(k)].cast<double>();
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

std::size_t RigSolver::memory_needed(const CalibrationOptions& options,
                                     const MonitorOptions& monitor, int cameras,
                                     std::size_t features) noexcept {
  const BundleCapacities c = capacities(options, cameras, features);
  const auto frames = static_cast<std::size_t>(options.max_frames);
  return TrackLog::memory_needed(frames, features) + BundleAdjuster::memory_needed(c) +
         Monitor::memory_needed(monitor) + MotionTrackBuilder::memory_needed(features) +
         c.poses * (sizeof(Transform) + sizeof(std::uint16_t) + sizeof(std::uint8_t)) +
         (c.poses + 1) * sizeof(int) + c.points * sizeof(Vec3) +
         c.observations * (sizeof(BundleObservation) + 2 * sizeof(float)) +
         frames * features * sizeof(Reference) + features * sizeof(StereoObservation) +
         12 * kCacheLine;
}

RigSolver::RigSolver(const CalibrationOptions& options, const MonitorOptions& monitor, int cameras,
                     std::size_t features, Arena& arena)
    : options_(options),
      log_(static_cast<std::size_t>(options.max_frames), features, arena),
      adjuster_(capacities(options, cameras, features), arena),
      monitor_(monitor, arena),
      expected_scatter_px_(monitor.found_bias_px),
      track_builder_(features, arena),
      most_frames_(static_cast<std::size_t>(options.max_frames)),
      count_(cameras) {
  const BundleCapacities c = capacities(options, cameras, features);
  poses_ = BoundedVector<Transform>(arena.make<Transform>(c.poses, "calibration poses"));
  held_ = BoundedVector<std::uint8_t>(arena.make<std::uint8_t>(c.poses, "calibration poses"));
  ties_ = arena.make<int>(c.poses + 1, "calibration poses");
  logged_ = BoundedVector<std::uint16_t>(arena.make<std::uint16_t>(c.poses, "calibration poses"));
  points_ = BoundedVector<Vec3>(arena.make<Vec3>(c.points, "calibration points"));
  observations_ = BoundedVector<BundleObservation>(
      arena.make<BundleObservation>(c.observations, "calibration observations"));
  residuals_ = arena.make<float>(c.observations, "calibration residuals");
  sorted_ = arena.make<float>(c.observations, "calibration residuals");
  references_ = BoundedVector<Reference>(
      arena.make<Reference>(most_frames_ * features, "calibration tracks"));
  stereo_ = BoundedVector<StereoObservation>(
      arena.make<StereoObservation>(features, "calibration matches"));
}

bool RigSolver::choose_candidate(const RigCalibration& rig) noexcept {
  const LoggedFrame* best = nullptr;
  for (std::size_t i = 0; i < log_.size(); ++i) {
    const LoggedFrame& f = log_.frame(i);
    if (!f.unlinked || f.stereo < kLeastCandidateMatches) continue;
    if (best == nullptr || f.reprojection_px < best->reprojection_px) best = &f;
  }
  if (best == nullptr) return false;
  for (int k = 1; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    T_camera_left_[c] = best->T_camera_left[c];
    T_camera_left_[c].R = normalised(T_camera_left_[c].R);
    if (!T_camera_left_[c].finite() || !(T_camera_left_[c].t.norm() > 0)) return false;
  }
  // The known length is camera 1's; what the others were measured to goes with it.
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

/// As many of the logged frames as there is room for, counted from the newest, so that it is in.
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

void RigSolver::sort_tracks() noexcept {
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
}

bool RigSolver::add_point(std::span<const Reference> track) noexcept {
  const auto observation = [&](const Reference& r) -> const LoggedObservation& {
    return log_.frame(logged_[r.frame]).observations[r.observation];
  };
  int pairs = 0;
  for (const Reference& r : track)
    pairs += (observation(r).cameras & 1U) != 0 && (observation(r).cameras & ~1U) != 0 ? 1 : 0;
  if (pairs < 2 || points_.full()) return true;  // four images see it, or it is none (METHOD §3)

  std::array<RayView, kMostViews * kMaxCameras> views;
  std::size_t n = 0;
  const std::size_t step = (track.size() + kMostViews - 1) / kMostViews;
  for (std::size_t i = 0; i < track.size(); i += step) {
    const LoggedObservation& s = observation(track[i]);
    for (int k = 0; k < count_; ++k) {
      const auto c = static_cast<std::size_t>(k);
      Vec3 ray;
      if (!s.by(k) || !cameras_[c].unproject(pixel_of(s, k), &ray)) continue;
      views[n++] = {T_camera_left_[c] * poses_[track[i].frame], ray.head<2>() / ray.z(),
                    static_cast<double>(s.sigma) / cameras_[c].intrinsics().fx};
    }
  }
  const TriangulatedPoint p = triangulate(std::span(views).first(n), TriangulateOptions{});
  if (p.status != TriangulateStatus::ok && p.status != TriangulateStatus::no_parallax) return true;

  const std::size_t first = observations_.size();
  for (const Reference& r : track) {
    const LoggedObservation& s = observation(r);
    for (int k = 0; k < count_; ++k) {
      if (!s.by(k)) continue;
      const auto c = static_cast<std::size_t>(k);
      const Vec2 seen = pixel_of(s, k);
      Vec2 at;
      if (cameras_[c].project(T_camera_left_[c] * (poses_[r.frame] * p.p_world), &at, nullptr) !=
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
  sort_tracks();
  std::size_t begin = 0;
  while (begin < references_.size()) {
    std::size_t end = begin + 1;
    while (end < references_.size() && references_[end].track == references_[begin].track) ++end;
    if (!add_point(references_.span().subspan(begin, end - begin))) return;
    begin = end;
  }
}

/// A frame that hardly a track ties to the ones before it (the scene was rebuilt there) begins a
/// piece of its own: its pose is held, as the first one is, for nothing else would.
void RigSolver::hold_pieces() noexcept {
  held_.clear();
  for (std::size_t i = 0; i < poses_.size(); ++i) (void)held_.push(0);
  // Points that are seen on both sides of a frame's beginning: +1 after the first of its frames, −1
  // after the last.
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
  for (std::size_t i = 0; i < held_.size(); ++i) {
    ties += ties_[i];
    held_[i] = ties < kLeastTies ? 1 : 0;
  }
}

BundleOptions RigSolver::options_of(const RigSolveRequest& request) const noexcept {
  constexpr std::uint16_t kFocal = 0b0011, kPinhole = 0b1111,
                          kFourCoefficients = 0b1111'0000;  // k1 k2 p1 p2, or k1 … k4
  const RigCalibration& rig = request.rig;
  const bool lenses = request.freedom == RigFreedom::lenses;
  BundleOptions how;
  how.configuration = BundleConfiguration::stereo_calibration;
  how.shared_errors = kSharedErrors;
  how.cells = kCells;
  how.length[1] = {BundleLength::exact, rig.baseline, 0};
  for (int k = 2; k < count_; ++k)
    how.length[static_cast<std::size_t>(k)].kind = BundleLength::free;
  for (int k = 0; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const Intrinsics& lens =
        (request.given != nullptr && lenses ? *request.given : rig).intrinsics[c];
    BundleIntrinsics& out = how.intrinsics[c];
    if (options_.refine_intrinsics != 0)
      out.free = kPinhole;
    else if (k > 0)
      out.free = lenses                                 ? kPinhole
                 : options_.estimate_focal_lengths != 0 ? kFocal
                                                        : std::uint16_t{0};
    if (lenses) out.free = static_cast<std::uint16_t>(out.free | kFourCoefficients);
    const std::array value = {lens.fx, lens.fy, lens.cx, lens.cy};
    for (std::size_t i = 0; i < 4; ++i) {
      const bool focal = i < 2;
      const double usual = focal             ? 0.01 * options_.focal_sigma_percent * value[i]
                           : lenses && k > 0 ? options_.lens_centre_sigma_px
                                             : options_.principal_point_sigma_px;
      out.prior_mean[i] = value[i];
      out.prior_sigma[i] = out.held_sigma[i] = lens.sigma[i] > 0 ? lens.sigma[i] : usual;
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
    // What is known of the lenses already holds what a prior would add.
    for (std::size_t i = 0; i < 8; ++i)
      if (request.known->covariance.known(intrinsic_row(k) + static_cast<int>(i)))
        out.prior_sigma[i] = 0;
  }
  if (request.known != nullptr)
    how.shared_prior = {request.known,
                        request.known->inflation > 0 ? request.known->inflation : kUsualInflation};
  return how;
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
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(n / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.begin() + static_cast<std::ptrdiff_t>(n));
  return std::max(0.2, std::sqrt(static_cast<double>(*middle)) / kMedianOfTwo);
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
    // What is left of a point has to hold it, and say something about the rig.
    unsigned cameras = 0;
    for (std::size_t j = first; j < kept; ++j) cameras |= 1U << observations_[j].camera;
    if (kept - first < 3 || (cameras & (cameras - 1U)) == 0) kept = first;
    begin = i;
  }
  observations_.truncate(kept);
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
  s->observations = static_cast<int>(observations_.size());
}

void RigSolver::write_result(const BundleResult& r, RigSolution* s) const noexcept {
  // What uncertain intrinsics do to the scale of the path (METHOD's numbers, §3.3 and §5): half of
  // what the focal lengths are off, and 0.31 % for each mrad that the principal points are off.
  constexpr double kScaleByFocal = 0.5, kScaleByRadian = 3.1;
  RigCalibration& rig = s->rig;
  for (int k = 0; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const Intrinsics& lens = cameras_[c].intrinsics();
    rig.intrinsics[c] = with_sigmas(lens, r.intrinsics_sigma[c]);
    if (k == 0) continue;
    rig.T_camera_left[c] = {normalised(T_camera_left_[c].R), T_camera_left_[c].t};
    rig.covariance_wide[c] = r.covariance_wide[c];
    for (int i = 0; i < 6; ++i) {
      rig.sigma_noise[c][static_cast<std::size_t>(i)] =
          std::sqrt(std::max(0.0, r.covariance_noise[c](i, i)));
      rig.sigma_wide[c][static_cast<std::size_t>(i)] =
          std::sqrt(std::max(0.0, r.covariance_wide[c](i, i)));
    }
  }
  rig.covariance = r.covariance;
  rig.inflation = r.inflation;
  rig.frames = s->frames;
  rig.found = log_.frame(log_.size() - 1).stamp;
  rig.reprojection_px = r.rms_px;
  const double focal = options_.focal_sigma_percent * 0.01,
               centre = options_.principal_point_sigma_px / rig.intrinsics[0].fx;
  double noise = 0;
  if (r.has_pose_covariance && s->travelled_m > 0) {
    const Vec3 way = poses_.back().t.normalized();
    const double white = r.covariance_white[1](1, 1), clustered = r.covariance_noise[1](1, 1);
    const double inflation = white > 0 ? std::max(1.0, clustered / white) : 1.0;
    noise = std::sqrt(std::max(0.0, way.dot(r.pose_covariance.bottomRightCorner<3, 3>() * way)) *
                      inflation) /
            s->travelled_m;
  }
  rig.scale_sigma = std::hypot(noise, std::hypot(kScaleByFocal * focal, kScaleByRadian * centre));
}

/// What the monitor would have said during the drive, had it known the result: a camera out of
/// step, or two rigs in one solve.
void RigSolver::watch_frames(RigSolution* s) noexcept {
  const Intrinsics &a = cameras_[0].intrinsics(), &b = cameras_[1].intrinsics();
  const Pinhole left{a.fx, a.fy, a.cx, a.cy}, right{b.fx, b.fy, b.cx, b.cy};
  if (!monitor_.set_reference(s->rig.T_camera_left[1], left, right, s->rig.covariance_wide[1]))
    return;
  monitor_.expect_scatter(expected_scatter_px_);
  track_builder_.reset();
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const LoggedFrame& f = log_.frame(logged_[i]);
    stereo_.clear();
    for (const LoggedObservation& observation : f.observations) {
      Vec3 l, r;
      if (!observation.by(0) || !observation.by(1) ||
          !cameras_[0].unproject(pixel_of(observation, 0), &l) ||
          !cameras_[1].unproject(pixel_of(observation, 1), &r))
        continue;
      (void)stereo_.push(
          {Vec2(left.fx * l.x() / l.z() + left.cx, left.fy * l.y() / l.z() + left.cy),
           Vec2(right.fx * r.x() / r.z() + right.cx, right.fy * r.y() / r.z() + right.cy),
           static_cast<double>(observation.sigma), observation.track});
    }
    const Transform step = i == 0 ? Transform{} : poses_[i] * poses_[i - 1].inverse();
    const MonitorVerdict v =
        monitor_.look(track_builder_.next(f.stamp, f.number, stereo_.span(), step));
    s->lag_frames = v.lag_frames;
    if (v.kind == MonitorVerdict::Kind::out_of_step) s->out_of_step = true;
    if (v.kind == MonitorVerdict::Kind::knock && v.statistic > kCertainChange * v.threshold)
      s->changed_at = v.onset_frame;
  }
}

/// Huber, then Cauchy twice, each time without what lies beyond some scales of the residuals;
/// covariances with the last.
BundleResult RigSolver::adjust_robustly(BundleOptions how, RigSolution* s) noexcept {
  how.loss = BundleLoss::huber;
  how.loss_threshold = kHuber;
  how.max_steps = 12;
  how.cost_tolerance = 1e-3;
  BundleResult r = adjust(how);
  s->steps = r.steps;
  for (const double cut : {kFirstCut, kLastCut}) {
    if (!r.usable()) return r;
    const double scale = residual_scale();
    drop_outliers(cut * scale);
    how.loss = BundleLoss::cauchy;
    how.loss_threshold = kCauchy * scale;
    const bool last = cut == kLastCut;
    how.max_steps = last ? 60 : 8;
    how.cost_tolerance = last ? 3e-6 : 1e-4;
    how.covariance = how.pose_covariance = last;
    r = adjust(how);
    s->steps += r.steps;
  }
  return r;
}

RigSolution RigSolver::solve(const RigSolveRequest& request) noexcept {
  const auto start = std::chrono::steady_clock::now();
  RigSolution s;
  s.rig = request.rig;
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
  if (points_.size() < static_cast<std::size_t>(kLeastTracks)) return s;
  hold_pieces();
  s.status = RigSolveStatus::not_converged;
  const BundleResult r = adjust_robustly(options_of(request), &s);
  if (!r.converged()) return s;
  describe(&s);
  s.status = r.has_covariance ? RigSolveStatus::ok : RigSolveStatus::not_observable;
  if (s.status == RigSolveStatus::ok) {
    write_result(r, &s);
    if (request.known != nullptr) s.rig.frames += request.known->frames;
    watch_frames(&s);
  }
  s.solve_ms = milliseconds_since(start);
  return s;
}

}  // namespace vergence::calibration
