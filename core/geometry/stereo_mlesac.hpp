#pragma once
#include <cstdint>
#include <span>

#include "core/geometry/epipolar.hpp"
#include "core/math/random.hpp"
#include "core/memory/arena.hpp"

namespace vergence {

/// Stereo matches as undistorted rays (x, y) = (X/Z, Y/Z). Views of equal length.
struct StereoMatches {
  std::span<const double> left_x, left_y, right_x, right_y;
  /// Standard deviation of one coordinate in either image: pixel sigma / focal length, > 0.
  std::span<const double> sigma;
  [[nodiscard]] std::size_t size() const noexcept { return left_x.size(); }
};

struct StereoMlesacOptions {
  /// Maximum number of five-point samples; each gives up to ten matrices.
  int max_hypotheses = 500;
  /// Minimum number of samples; the first good one is rarely the best.
  int min_hypotheses = 20;
  double confidence = 0.999;
  /// T² in squared sigmas: χ² at 99 % for the one residual of a match.
  double outlier_cost = 6.63;
};

struct StereoEstimate {
  /// See MlesacPose::found; needs at least five matches.
  bool found = false;
  Transform T_right_left{};

  /// Σ JᵀJ/σ² over the inliers, for δ of moved_on_sphere().
  Mat5 information = Mat5::Zero();
  /// Standard deviation of the direction of t, in rad; infinite if the matches do not determine it.
  double direction_sigma = 0;

  /// Number of matches within T² and in front of both cameras.
  int inliers = 0;
  int samples = 0;
};

/// Estimates the stereo transform from matches with outliers: MLESAC in its truncated form (see
/// mlesac.hpp) over five-point samples,
///
///     C = Σ_i min(d_i²/σ_i², T²),   d the Sampson distance,
///
/// with buckets over the left image, an adaptive stop, and each new best refined by Gauss–Newton on
/// the five parameters over its inliers. Ownership, threads, memory and determinism as for
/// RigMlesac.
class StereoMlesac {
 public:
  /// `capacity`: maximum number of matches. Throws std::length_error if the arena is full.
  StereoMlesac(std::size_t capacity, Arena& arena);

  /// `baseline`: |t| in metres, > 0, which images cannot determine.
  [[nodiscard]] StereoEstimate estimate_stereo_transform(const StereoMatches& matches,
                                                         double baseline,
                                                         const StereoMlesacOptions& options,
                                                         Random& random) noexcept;

  /// Per match of the last call, 1 for an inlier. Valid until the next.
  [[nodiscard]] std::span<const std::uint8_t> flags() const noexcept {
    return flags_.first(matches_);
  }

 private:
  void gather(const StereoMatches& matches, double cap) noexcept;
  [[nodiscard]] double score(const Mat3& E, double best) const noexcept;
  /// Chooses the transform of E that has most of the matches explained by E in front. Returns false
  /// if there is none.
  [[nodiscard]] bool best_transform(const Mat3& E, double cap, double baseline,
                                    Transform* T) noexcept;
  [[nodiscard]] bool polish(double cap, Transform* T) const noexcept;
  /// `gradient`: −Σ J r/σ².
  [[nodiscard]] Mat5 information(double cap, const Transform& T, Vec5* gradient) const noexcept;
  int flag(double cap, const Transform& T) noexcept;

  // Columns for scoring.
  std::span<float> x1_, y1_, x2_, y2_, weight_, cap_;
  // Usable matches.
  std::span<Vec2> left_, right_;
  // Matches that a matrix explains.
  std::span<Vec2> near_left_, near_right_;
  std::span<double> inverse_sigma_;
  // Index in the input.
  std::span<std::uint32_t> match_;
  std::span<std::uint8_t> bucket_, flags_;
  std::size_t matches_ = 0, count_ = 0, whole_ = 0;
};

}  // namespace vergence
