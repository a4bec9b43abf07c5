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
  int max_hypotheses = 100;  // three-point samples, 1 … 10 000; each gives up to four poses
  int min_hypotheses =
      8;  // even when the prior explains everything: the prior's noise is not the frame's
  double confidence = 0.999;  // that one sample at least was free of outliers; sets the adaptive
                              // stop, 0.5 … 0.999999
  double outlier_cost = kChi2OfPixel;
};

struct MlesacPose {
  /// There is a pose; the caller decides whether its inliers suffice. Not found where the input
  /// or the options cannot be, there are more points than the workspace holds, or without a prior
  /// no camera has three usable observations or no sample gave a pose.
  bool found = false;
  Transform T_left_world{};
  int inliers = 0;              // points all of whose `seen` observations are usable, within T²
  int inlier_observations = 0;  // of `observations`
  int observations = 0;         // usable, of all cameras
  double score = 0;             // C below, lower is better
  int samples = 0;              // three-point samples drawn
};

/// Pose of a rig in the world from points seen by any of its cameras, outliers among them.
///
/// A sample is three points that one camera sees, in three different buckets of its image (8 × 6
/// over what it sees), so that they lie apart; camera k's three-point pose becomes T_left_world =
/// T_camera_left[k]⁻¹ T_k_world. Each hypothesis is scored over every observation of every camera
/// by the truncated form of MLESAC's likelihood (P. H. S. Torr, A. Zisserman, "MLESAC", CVIU 78,
/// 2000: the mixture of a Gaussian for inliers and a uniform density for outliers; its cost ρ₂):
///
///     C = Σ_o min(e_o², T²),   e_o² = |measured − projected|² / σ_o²;   behind the camera: T²
///
/// T² is where the two densities of the mixture cross. Scoring stops once C exceeds the best so
/// far, which changes nothing. A sample's pose carries the noise of three points only; so each new
/// best is polished by a few least-squares steps over its inliers and kept if that lowers C (local
/// optimisation: O. Chum, J. Matas, J. Kittler, DAGM 2003). Stop after N = ln(1 − confidence) /
/// ln(1 − w³) samples, w the share of inlier observations of the best so far.
///
/// Ownership  Workspace in the arena it was made in. flags() stay valid until the next solve().
/// Threads    One caller per object; several objects may run side by side.
/// Memory     All at construction.
/// Precision  Scores in float about the points' mean (0.01 px for points within 100 times their
///            distance), flags in double.
/// Errors     Not found: the pose is the identity and means nothing.
/// Same input, options and random state: same result, on every instruction set.
class RigMlesac {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  /// At most `capacity` points. Throws std::length_error when the arena is full.
  RigMlesac(std::size_t capacity, Arena& arena);

  /// `prior` (may be null): a pose worth trying first, constant velocity's prediction for instance.
  [[nodiscard]] MlesacPose solve(const RigObservations& observations, const MlesacOptions& options,
                                 const Transform* prior, Random& random) noexcept;

  /// For each point of the last solve(): bit k set if camera k's observation is within T². An
  /// inlier is a point whose flags equal its `seen` bits.
  [[nodiscard]] std::span<const std::uint8_t> flags() const noexcept {
    return flags_.first(points_);
  }

 private:
  struct CameraSet {
    std::span<float> x, y, z, u, v, weight, cap;  // columns for scoring
    std::span<std::uint32_t> point;               // index into the input
    std::span<std::uint8_t> bucket;               // of the image
    std::size_t count = 0;
    std::size_t scored = 0;  // count rounded up to whole blocks
  };

  void gather(const RigObservations& observations, double cap) noexcept;
  [[nodiscard]] bool draw(const CameraSet& set, Random& random,
                          std::array<std::uint32_t, 3>* picks) const noexcept;
  [[nodiscard]] double score(const RigObservations& observations, const Transform& T_left_world,
                             double best) const noexcept;
  void flag(const RigObservations& observations, double cap, MlesacPose* pose) noexcept;

  /// Least squares over the inliers of *T, at most kPolishSteps; false: *T untouched.
  [[nodiscard]] bool polish(double cap, Transform* T) noexcept;

  std::array<CameraSet, kMaxCameras> sets_{};
  detail::PoseProblem problem_;
  std::span<std::uint8_t> flags_;
  Vec3 centre_ = Vec3::Zero();  // of the points, world
  std::size_t points_ = 0;
  int observations_ = 0;
};

/// Samples after which, with share `inliers` of good data, one of `size` points is clean with that
/// confidence; ≥ 1, capped.
[[nodiscard]] int samples_needed(double inliers, int size, double confidence, int cap) noexcept;

}  // namespace vergence
