#include "core/calibration/disparity_jump.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/robust.hpp"

namespace vergence::calibration {
namespace {

// Minimum of the usual rms shift of undisturbed frames, in px (build/bench/margin_bench).
constexpr double kUsualShift = 0.12;
// Number of measured frames over which the usual shift is averaged.
constexpr int kScatterFrames = 20;
// Maximum number of frames without a measurement between two that are compared.
constexpr int kMaxSkipped = 2;

/// Derivative of project(), in px per unit of `p`.
Mat23 derivative(const Pinhole& k, const Vec3& p) noexcept {
  Mat23 G;
  G << k.fx, 0, -k.fx * p.x() / p.z(), 0, k.fy, -k.fy * p.y() / p.z();
  return G / p.z();
}

/// Depth of the left ray where it is nearest to the other camera's ray; not positive if there is
/// none.
double triangulated_depth(const Vec3& left, const Vec3& other,
                          const Transform& T_other_left) noexcept {
  // other ∥ z R left + t, so other × (R left) z = − other × t.
  const Vec3 a = other.cross(T_other_left.R * left), b = -other.cross(T_other_left.t);
  const double aa = a.squaredNorm();
  return aa > 0 ? a.dot(b) / aa : -1.0;
}

/// Replaces the content of `into` by observations sorted by track.
void sort_into(std::span<const StereoObservation> stereo,
               BoundedVector<StereoObservation>* into) noexcept {
  into->clear();
  for (const StereoObservation& s : stereo)
    if (!into->push(s)) break;
  std::ranges::sort(*into, {}, &StereoObservation::track);
}

}  // namespace

DisparityJumpDetector::DisparityJumpDetector(std::size_t capacity, Arena& arena)
    : before_(arena.make<StereoObservation>(capacity, "disparity jump: the frame before")),
      now_(arena.make<StereoObservation>(capacity, "disparity jump: this frame")),
      rows_(arena.make<Row>(capacity, "disparity jump: tracks")),
      scratch_(arena.make<double>(capacity, "disparity jump: medians")) {}

void DisparityJumpDetector::rebase(const StereoPair& pair,
                                   std::span<const StereoObservation> stereo) noexcept {
  pair_ = pair;
  sort_into(stereo, &before_);
  T_now_before_ = {};
  skipped_ = 0;
}

void DisparityJumpDetector::skip(const Transform& T_now_previous) noexcept {
  T_now_before_ = T_now_previous * T_now_before_;
  if (++skipped_ > kMaxSkipped) before_.clear();
}

void DisparityJumpDetector::add_row(const StereoObservation& before, const StereoObservation& now,
                                    const Transform& T_now_previous) noexcept {
  const Transform& T = pair_.T_camera_left;
  const Vec3 a = ray(pair_.left, before.left).homogeneous();
  const double depth = triangulated_depth(a, ray(pair_.camera, before.right).homogeneous(), T);
  if (!(depth > 0)) return;
  const Vec3 moved = T_now_previous * Vec3(depth * a);
  if (!(moved.z() > 0)) return;
  const Vec3 other = T * moved;
  const Mat23 G = derivative(pair_.camera, other);
  const Vec2 predicted = project(pair_.camera, other) - project(pair_.left, moved);
  const Vec2 by_depth = G * T.R.col(2) - derivative(pair_.left, moved).col(2);
  // Direction of the epipolar line, along which the point moves in the other image with its depth.
  const Vec2 farther = G * (T.R * moved);
  const double length = farther.norm();
  if (!(length > 0)) return;
  const Vec2 direction = farther / length;
  const Row row{direction.dot(now.right - now.left - predicted), direction.dot(by_depth)};
  if (std::isfinite(row.e) && std::isfinite(row.along)) (void)rows_.push(row);
}

DisparityJump DisparityJumpDetector::fit() noexcept {
  DisparityJump jump;
  if (rows_.size() < kMinTracksOfFrame) return jump;
  const auto median_by = [&](auto value) noexcept {
    for (std::size_t i = 0; i < rows_.size(); ++i) scratch_[i] = value(rows_[i]);
    return median(scratch_.first(rows_.size()));
  };
  double s = median_by([](const Row& r) noexcept { return r.e; });
  double along = 0, scale = 0, variance = 0;
  for (int k = 0; k < kReweightings; ++k) {
    scale = std::max(kMinScale, median_by([&](const Row& r) noexcept {
                                  return std::abs(r.e - s - along * r.along);
                                }) / kMedianOfNormal);
    double w = 0, wa = 0, waa = 0, we = 0, wae = 0;
    for (const Row& r : rows_) {
      const double off = r.e - s - along * r.along, weight = tukey(off * off, kTukey * scale);
      w += weight;
      wa += weight * r.along;
      waa += weight * r.along * r.along;
      we += weight * r.e;
      wae += weight * r.along * r.e;
    }
    const double determinant = w * waa - wa * wa;
    if (!(determinant > 1e-9 * w * waa)) return jump;
    s = (waa * we - wa * wae) / determinant;
    along = (w * wae - wa * we) / determinant;
    variance = scale * scale * waa / determinant;
  }
  jump.measured = true;
  jump.px = s;
  jump.sigma_px = std::sqrt(variance);
  return jump;
}

void DisparityJumpDetector::evaluate(std::uint64_t frame, DisparityJump* jump) noexcept {
  if (pending_) {
    if (!jump->measured && ++pending_->unmeasured < kMaxSkipped) {
      jump->suspected = true;
      return;
    }
    jump->confirmed =
        !jump->measured || std::abs(jump->px + pending_->px) > kMajority * std::abs(pending_->px);
    if (jump->confirmed) {
      jump->onset_frame = pending_->frame;
      jump->px = pending_->px;
      jump->sigma_px = pending_->sigma_px;
    }
    pending_.reset();
    return;
  }
  if (!jump->measured) return;
  const double limit =
      kOutlierSigmas * std::sqrt(std::max(kUsualShift * kUsualShift, mean_square_) +
                                 jump->sigma_px * jump->sigma_px);
  if (measured_ >= kMinForMean) jump->over_limit = std::abs(jump->px) / limit;
  if (jump->over_limit > 1) {
    jump->suspected = true;
    pending_ = Pending{frame, jump->px, jump->sigma_px};
    return;
  }
  if (measured_ < kScatterFrames) ++measured_;
  mean_square_ += (jump->px * jump->px - mean_square_) / measured_;
}

DisparityJump DisparityJumpDetector::next(std::uint64_t frame,
                                          std::span<const StereoObservation> stereo,
                                          const Transform& T_now_previous) noexcept {
  sort_into(stereo, &now_);
  const Transform T_now_before = T_now_previous * T_now_before_;
  T_now_before_ = {};
  skipped_ = 0;
  rows_.clear();
  for (std::size_t i = 0, j = 0; i < before_.size() && j < now_.size();) {
    if (before_[i].track < now_[j].track) {
      ++i;
    } else if (now_[j].track < before_[i].track) {
      ++j;
    } else {
      add_row(before_[i++], now_[j++], T_now_before);
    }
  }
  DisparityJump jump = fit();
  evaluate(frame, &jump);
  std::swap(before_, now_);
  return jump;
}

}  // namespace vergence::calibration
