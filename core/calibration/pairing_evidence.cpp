#include "core/calibration/pairing_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "core/calibration/detail/monitor_residuals.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/math/robust.hpp"

namespace vergence::calibration {
namespace {

// Noise of the distance in px, from two positions known to 0.15 px.
constexpr double kNoise = 0.2;
// Page's reference value: the log ratio that chance gives at standstill for two widths, each known
// to a tenth. Without it the sum would drift above any bound.
constexpr double kReference = 0.25;

}  // namespace

PairingEvidence::PairingEvidence(std::size_t capacity, Arena& arena)
    : before_(arena.make<StereoObservation>(capacity, "pairing: the frame before")),
      now_(arena.make<float>(capacity, "pairing: distances")),
      late_px_(arena.make<float>(capacity, "pairing: distances, camera late")),
      early_px_(arena.make<float>(capacity, "pairing: distances, left late")) {}

void PairingEvidence::next(std::uint64_t frame, std::span<StereoObservation> points,
                           const StereoPair& pair) noexcept {
  if (frame != frame_ + 1) before_.clear();
  frame_ = frame;
  points = points.first(std::min(points.size(), before_.capacity()));
  std::ranges::sort(points, {}, &StereoObservation::track);
  const EpipolarGeometry lines(pair.T_camera_left);
  const auto distance = [&](const Vec2& in_left, const Vec2& in_camera) noexcept {
    double d = 0;
    (void)lines.sampson(ray(pair.left, in_left), ray(pair.camera, in_camera), &d, nullptr);
    return static_cast<float>(std::abs(d) * pair.camera.fx);
  };
  std::size_t n = 0, both = 0;
  for (const StereoObservation& now : points) {
    now_[n++] = distance(now.left, now.right);
    const auto* before =
        std::ranges::lower_bound(before_, now.track, {}, &StereoObservation::track);
    if (before == before_.end() || before->track != now.track) continue;
    late_px_[both] = distance(before->left, now.right);
    early_px_[both++] = distance(now.left, before->right);
  }
  before_.clear();
  for (const StereoObservation& now : points) (void)before_.push(now);
  distance_px_ = n > 0 ? static_cast<double>(median(now_.first(n))) : 0;
  if (both < kMinTracksOfFrame) return;
  const double now = std::max(distance_px_, kNoise);
  if (usual_px_ == 0) usual_px_ = now;
  const auto add = [&](double usual, double other, double* sum) noexcept {
    const double u = usual / usual_px_;
    const double ratio = std::log(other / usual_px_) - 0.5 * (u * u - 1);
    *sum = std::clamp(*sum + kPointsOfAFrame * (std::clamp(ratio, -1.0, 1.0) - kReference), 0.0,
                      kDecided + kPointsOfAFrame);
  };
  for (std::size_t i = 0; i < 2; ++i) {
    const std::span<float> px = (i == 0 ? late_px_ : early_px_).first(both);
    const double other = std::max(static_cast<double>(median(px)), kNoise);
    add(other, now, &shifted_[i]);
    add(now, other, &in_step_[i]);
  }
  if (lag_frames() != 0) question();
  if (cameras_in_sync()) questioned_ = false;
  if (std::max(shifted_[0], shifted_[1]) < 1) usual_px_ += detail::kFastUpdate * (now - usual_px_);
}

}  // namespace vergence::calibration
