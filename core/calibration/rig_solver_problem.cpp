#include <algorithm>
#include <array>
#include <span>

#include "core/calibration/rig_solver.hpp"
#include "core/geometry/triangulate.hpp"

/// Construction of the bundle adjustment from the track log: points, observations, options.
namespace vergence::calibration {
namespace {

// Maximum number of frames that a point is triangulated from.
constexpr std::size_t kMaxViews = 12;
// Initial residual in px above which an observation is of another point.
constexpr double kWildResidual = 40.0;
// Minimum number of points that connect a frame to earlier ones.
constexpr int kMinTies = 10;
// Tracks share errors that clusters by track do not capture, so clusters are image cells (kCells a
// side) and blocks of frames. kSharedErrors is the remaining ratio of the true variance of
// transforms, on recorded and rendered sequences, to that by clusters (docs/calibration.md).
constexpr int kCells = 6;
constexpr double kSharedErrors = 3.5;

}  // namespace

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
  // A point must be seen in at least four images.
  if (pairs < 2 || points_.full()) return true;

  std::array<RayView, kMaxViews * kMaxCameras> views;
  std::size_t n = 0;
  const std::size_t step = (track.size() + kMaxViews - 1) / kMaxViews;
  for (std::size_t i = 0; i < track.size(); i += step) {
    const LoggedObservation& s = observation(track[i]);
    for (int k = 0; k < count_; ++k) {
      const auto c = static_cast<std::size_t>(k);
      Vec3 ray;
      if (!s.by(k) || !cameras_[c].unproject(observed_pixel(s, k), &ray)) continue;
      views[n++] = {T_camera_left_[c] * poses_[track[i].frame], ray.head<2>() / ray.z(),
                    static_cast<double>(s.sigma) / cameras_[c].intrinsics().fx};
    }
  }
  const TriangulatedPoint p = triangulate(std::span(views).first(n));
  if (p.status != TriangulateStatus::ok && p.status != TriangulateStatus::no_parallax) return true;

  const std::size_t first = observations_.size();
  for (const Reference& r : track) {
    const LoggedObservation& s = observation(r);
    for (int k = 0; k < count_; ++k) {
      if (!s.by(k)) continue;
      const auto c = static_cast<std::size_t>(k);
      const Vec2 seen = observed_pixel(s, k);
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

/// Fixes the pose of each frame that hardly any track connects to earlier ones, where the map was
/// rebuilt, because nothing else would constrain it.
void RigSolver::hold_pieces() noexcept {
  held_.clear();
  for (std::size_t i = 0; i < poses_.size(); ++i) (void)held_.push(0);
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
  for (std::size_t i = 0; i < held_.size(); ++i) {
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
  for (int k = 2; k < count_; ++k)
    how.length[static_cast<std::size_t>(k)].kind = BundleLength::free;
  for (int k = 0; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const Intrinsics& lens = (request.given != nullptr ? *request.given : rig).intrinsics[c];
    BundleIntrinsics& out = how.intrinsics[c];
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
    for (std::size_t i = 0; i < 8; ++i)
      if (request.known->covariance.known(intrinsic_row(k) + static_cast<int>(i)))
        out.prior_sigma[i] = 0;
  }
  if (request.known != nullptr) how.shared_prior = {request.known, request.known->inflation};
  return how;
}

}  // namespace vergence::calibration
