#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/detail/pose_problem.hpp"
#include "core/geometry/observations.hpp"
#include "core/math/random.hpp"
#include "core/math/robust.hpp"
#include "core/memory/arena.hpp"

namespace vergence {

struct MlesacOptions {
  /// Maximum number of three-point samples, 1 … 10 000; each gives up to four poses.
  int max_hypotheses = 100;
  /// Minimum number of samples, even if the prior fits, because its noise is not that of the frame.
  int min_hypotheses = 8;
  /// Probability that at least one sample has no outlier, for the adaptive stop, 0.5 … 0.999999.
  double confidence = 0.999;
  double outlier_cost = kChi2OfPixel;
};

struct MlesacPose {
  /// True if there is a pose; the caller checks its inliers. False if the input or options are
  /// invalid, the workspace is too small, or, without a prior, no camera has three usable
  /// observations or no sample gave a pose.
  bool found = false;
  Transform T_left_world{};

  /// Number of points all of whose observations are usable and within T².
  int inliers = 0;
  int inlier_observations = 0;
  int samples = 0;
};

/// Estimates the pose of a rig in the world from points seen by any of its cameras, with outliers.
///
/// A sample is three points seen by one camera, spread over different buckets of its image (8 × 6
/// over the points' bounding rectangle); camera k's three-point pose becomes T_left_world =
/// T_camera_left[k]⁻¹ T_k_world. Each hypothesis is scored over every observation of every camera
/// by the truncated form of MLESAC's likelihood (P. H. S. Torr, A. Zisserman, "MLESAC", CVIU 78,
/// 2000: the mixture of a Gaussian for inliers and a uniform density for outliers; its cost ρ₂):
///
///     C = Σ_o min(e_o², T²),   e_o² = |measured − projected|² / σ_o²;   behind the camera: T²
///
/// T² is where the two densities of the mixture cross. Scoring stops once C exceeds the best so
/// far. Each new best, with the noise of three points only, is refined by a few least-squares steps
/// over its inliers if that lowers C (local optimisation: O. Chum, J. Matas, J. Kittler, DAGM
/// 2003). It stops after N = ln(1 − confidence) / ln(1 − w³) samples, with w the share of inlier
/// observations of the best so far.
///
/// Ownership  Workspace in the arena. flags() stay valid until the next solve().
/// Threads    One caller per object; several objects may run in parallel.
/// Memory     All at construction.
/// Precision  Scores in float about the points' mean (0.01 px for points within 100 times their
///            distance), flags in double.
/// Errors     If no pose is found, it is the identity. Same input, options and random state: same
///            result, on every instruction set.
class RigMlesac {
 public:
  /// `capacity`: maximum number of points. Throws std::length_error if the arena is full.
  RigMlesac(std::size_t capacity, Arena& arena);

  /// `prior` (may be null): a pose to try first, for example the constant-velocity prediction.
  [[nodiscard]] MlesacPose solve(const RigObservations& observations, const MlesacOptions& options,
                                 const Transform* prior, Random& random) noexcept;

  /// Per point of the last solve(), bit k is set if camera k's observation is within T². An inlier
  /// is a point whose flags equal its `seen` bits.
  [[nodiscard]] std::span<const std::uint8_t> flags() const noexcept {
    return flags_.first(points_);
  }

 private:
  struct CameraSet {
    // Columns for scoring.
    std::span<float> x, y, z, u, v, weight, cap;
    // Index in the input.
    std::span<std::uint32_t> point;
    // Bucket in the image.
    std::span<std::uint8_t> bucket;
    std::size_t count = 0;
    // `count` rounded up to whole blocks.
    std::size_t scored = 0;
  };

  void gather(const RigObservations& observations, double cap) noexcept;
  [[nodiscard]] bool draw(const CameraSet& set, Random& random,
                          std::array<std::uint32_t, 3>* picks) const noexcept;
  [[nodiscard]] double score(const RigObservations& observations, const Transform& T_left_world,
                             double best) const noexcept;
  void flag(const RigObservations& observations, double cap, MlesacPose* pose) noexcept;

  /// Least squares over the inliers of *T, at most kPolishSteps steps. If it fails, it returns
  /// false and leaves *T unchanged.
  [[nodiscard]] bool polish(double cap, Transform* T) noexcept;

  std::array<CameraSet, kMaxCameras> sets_{};
  detail::PoseProblem problem_;
  std::span<std::uint8_t> flags_;
  // Centre of the points in the world.
  Vec3 centre_ = Vec3::Zero();
  std::size_t points_ = 0;
  int observations_ = 0;
};

/// Number of samples (1 … `cap`) after which one of `size` points is free of outliers with that
/// confidence, for a share `inliers` of good data.
[[nodiscard]] int samples_needed(double inliers, int size, double confidence, int cap) noexcept;

}  // namespace vergence
