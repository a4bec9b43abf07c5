#include "core/estimator/calibration_frames.hpp"

#include <limits>

namespace vergence {
namespace {

using odometry::MapPoint;

// Minimum mean displacement of the tracks between two logged frames, in pixels; closer frames
// repeat the same errors.
constexpr double kMovedPixels = 1.0;

double pixels_moved(const odometry::Map& map) noexcept {
  double sum = 0;
  int n = 0;
  for (const MapPoint& p : map.points()) {
    if (!p.followed() || !p.logged || !p.now.by(0)) continue;
    sum += static_cast<double>((p.raw[0] - p.logged_at).norm());
    ++n;
  }
  return n == 0 ? std::numeric_limits<double>::infinity() : sum / n;
}

}  // namespace

CalibrationFrames::CalibrationFrames(const calibration::CalibrationOptions& options,
                                     std::size_t tracks, Arena& arena)
    : options_(options), log_(static_cast<std::size_t>(options.max_frames), tracks, arena) {}

void CalibrationFrames::add(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome,
                            const RigFrame& frame) noexcept {
  if (outcome.scale != 1.0) log_.scale_about(outcome.T_left_world.centre(), outcome.scale);
  ++frames_still_;
  if (!outcome.images_good || pixels_moved(odometry.map()) < kMovedPixels) return;
  calibration::LoggedFrame f;
  f.number = frame.number;
  f.stamp = frame.stamp;
  f.T_left_world = outcome.T_left_world;
  f.T_camera_left = odometry.rig().T_camera_left;
  f.unlinked = odometry.linked() == odometry::Link::unlinked;
  f.reprojection_px = outcome.reprojection_px;
  f.stereo = outcome.stereo_inliers;
  log_.begin(f);
  for (MapPoint& p : odometry.map().points()) {
    // A track is logged if it agrees with the left camera's pose. With linked cameras the other
    // cameras' observations are logged even if they disagree, so that the calibration in use does
    // not select the observations that test it.
    if (!p.followed() || !p.now.by(0)) continue;
    calibration::LoggedObservation s;
    s.track = p.id;
    s.cameras = f.unlinked ? p.now.cameras : p.in_images;
    s.sigma = p.now.sigma[0];
    s.raw = p.raw;
    log_.push(s);
    p.logged = true;
    p.logged_at = p.raw[0];
  }
  ++logged_;
  frames_still_ = 0;
}

void CalibrationFrames::begin_segment(std::uint64_t number) noexcept {
  log_.drop_before(number);
  solved_frames_ = 0;
  frames_still_ = 0;
  logged_ = log_.size();
  required_ = min_frames();
}

void CalibrationFrames::clear() noexcept {
  log_.clear();
  begin_segment();
}

void CalibrationFrames::require(std::size_t frames) noexcept {
  required_ = std::max(std::min(max_frames(), frames), logged_ + kMinForMean);
}

}  // namespace vergence
