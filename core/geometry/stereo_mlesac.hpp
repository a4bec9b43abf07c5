#pragma once
#include <cstdint>
#include <span>

#include "core/geometry/epipolar.hpp"
#include "core/math/random.hpp"
#include "core/memory/arena.hpp"

namespace vergence {

/// Matches across, undistorted rays (x, y) = (X/Z, Y/Z). All of one length; views.
struct StereoMatches {
  std::span<const double> left_x, left_y, right_x, right_y;
  std::span<const double>
      sigma;  // of one coordinate in either image: pixel sigma / focal length, > 0
  [[nodiscard]] std::size_t size() const noexcept { return left_x.size(); }
};

struct StereoMlesacOptions {
  int max_hypotheses = 500;  // five-point samples, each gives up to ten matrices
  int min_hypotheses = 20;   // the first good one is seldom the best
  double confidence = 0.999;
  double outlier_cost =
      6.63;  // T², squared sigmas: χ² of the one number that a match measures, at 99 %
};

struct StereoEstimate {
  bool found = false;               // as MlesacPose::found; from five matches on
  Transform T_right_left{};         // |t| = baseline
  Mat5 information = Mat5::Zero();  // of δ of moved_on_sphere(), Σ JᵀJ/σ² over the inliers
  double rotation_sigma = 0;   // rad, worst direction; infinite where the matches do not hold it
  double direction_sigma = 0;  // rad, of t, worst direction
  int inliers = 0;             // within T² and in front of both cameras
  double score = 0;            // C, lower is better
  int samples = 0;
};

/// Stereo transform from matches with outliers: MLESAC in its truncated form (see mlesac.hpp) over
/// five-point samples,
///
///     C = Σ_i min(d_i²/σ_i², T²),   d the Sampson distance,
///
/// bucketed over the left image, adaptive stop, each new best polished by Gauss–Newton on the five
/// parameters over its inliers. Ownership, threads, memory, determinism: as RigMlesac.
class StereoMlesac {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  /// At most `capacity` matches. Throws std::length_error when the arena is full.
  StereoMlesac(std::size_t capacity, Arena& arena);

  /// `baseline`: |t|, m, > 0: images do not tell it.
  [[nodiscard]] StereoEstimate estimate_stereo_transform(const StereoMatches& matches,
                                                         double baseline,
                                                         const StereoMlesacOptions& options,
                                                         Random& random) noexcept;

  /// For each match of the last call: 1 for an inlier. Valid until the next.
  [[nodiscard]] std::span<const std::uint8_t> flags() const noexcept {
    return flags_.first(matches_);
  }

 private:
  void gather(const StereoMatches& matches, double cap) noexcept;
  [[nodiscard]] double score(const Mat3& E, double best) const noexcept;
  /// The transform of E that has most of the matches E explains in front; false: none.
  [[nodiscard]] bool transform_of(const Mat3& E, double cap, double baseline,
                                  Transform* T) noexcept;
  [[nodiscard]] bool polish(double cap, Transform* T) const noexcept;
  [[nodiscard]] Mat5 information(double cap, const Transform& T,
                                 Vec5* gradient) const noexcept;  // gradient: −Σ J r/σ²
  int flag(double cap, const Transform& T) noexcept;

  std::span<float> x1_, y1_, x2_, y2_, weight_, cap_;  // columns for scoring
  std::span<Vec2> left_, right_;                       // the usable matches
  std::span<Vec2> near_left_, near_right_;             // those of them that a matrix explains
  std::span<double> inverse_sigma_;
  std::span<std::uint32_t> match_;  // index into the input
  std::span<std::uint8_t> bucket_, flags_;
  std::size_t matches_ = 0, count_ = 0, whole_ = 0;
};

}  // namespace vergence
