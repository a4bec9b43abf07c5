#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/bundle/bundle.hpp"
#include "core/types/parallel.hpp"

namespace vergence::detail {

/// Number of points processed together: the lanes of the widest SIMD vector.
inline constexpr int kBatch = 8;
/// Number of rows of one pose in the reduced system; θ_S is padded to a multiple.
inline constexpr int kBlock = 6;
/// Number of doubles in one block of Y.
inline constexpr int kYSize = kBlock * 3 * kBatch;
/// Number of doubles in its first three rows.
inline constexpr int kYTop = 3 * 3 * kBatch;
inline constexpr int kFactorRows = 11;
/// Depth of a point that no camera sees, in metres.
inline constexpr double kFar = 1e30;
/// 21 elements of the symmetric 6×6 and 6 of the gradient.
inline constexpr int kPoseSums = 27;
/// Maximum number of batches multiplied together; one block of each, 18 kB, fits into the L1 cache.
inline constexpr int kGroupLimit = 16;
inline constexpr int kMaxShared = kBlock * (kMaxCameras - 1) + kIntrinsicsSize * kMaxCameras;
inline constexpr int kMaxSharedBlocks = (kMaxShared + kBlock - 1) / kBlock;
/// Maximum number of image cells per side in a covariance by cells.
inline constexpr int kMaxCells = 8;

/// Observations of eight points in one image; inverse_sigma is 0 where there is none.
struct alignas(kCacheLine) Slot {
  double x[kBatch], y[kBatch], inverse_sigma[kBatch];
};

/// One pose that sees at least one point of a batch. The slots of its images follow each other from
/// `slot`, in ascending order of cameras.
struct PoseBlock {
  std::uint32_t slot = 0;
  std::uint16_t pose = 0;
  /// Bit k is set if camera k has a slot.
  std::uint8_t cameras = 0;
};

struct Batch {
  std::uint32_t block_begin = 0, block_end = 0;
  /// Batches of one group see the same poses.
  std::uint32_t group = 0;
  std::uint32_t lanes = 0;
};

struct KernelPose {
  /// T_left_world, row-major.
  double R[9], t[3];
  /// Its block in the reduced system; −1 if constant.
  std::int32_t block = -1;
};

struct KernelCamera {
  /// T_camera_left, row-major.
  double R[9], t[3];
  double fx, fy, cx, cy;
  /// Distortion and its range as in Camera.
  double distortion[5];
  double max_radius2;
  bool distorted, equidistant;
  /// Directions in which τ is free with an exact length.
  Eigen::Matrix<double, 3, 2, Eigen::RowMajor> basis;
  bool identity;
};

/// Layout of the rows of θ_S. Extrinsics of camera k: (τ, φ), or (β, φ) with τ = basis β; then free
/// intrinsics of each camera.
struct SharedLayout {
  int size = 0;
  /// Number of blocks of kBlock rows, the last one padded.
  int blocks = 0;
  /// First row; −1 if constant.
  int extrinsic[kMaxCameras] = {-1, -1, -1, -1};
  bool exact[kMaxCameras] = {};
  int intrinsic[kMaxCameras] = {-1, -1, -1, -1};
  int intrinsic_count[kMaxCameras] = {};
  std::uint8_t intrinsic_index[kMaxCameras][kIntrinsicsSize] = {};
};

using SharedMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxShared, kMaxShared>;
using SharedVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxShared, 1>;

/// Inputs and outputs of the kernels, as pointers into the adjuster's arena. Lane arrays are
/// [rows][kBatch].
struct KernelJob {
  const Batch* batches = nullptr;
  const PoseBlock* blocks = nullptr;
  const Slot* slots = nullptr;
  const KernelPose* poses = nullptr;
  KernelCamera cameras[kMaxCameras];
  /// [batch][3][kBatch].
  const double* points = nullptr;
  /// [batch][kBatch], 1 or 0.
  const double* point_free = nullptr;
  /// [batch][3][kBatch], output of back_substitute().
  double* candidate = nullptr;

  /// [block][3][3][kBatch]: rows of τ of Y = O L⁻ᵀ with P = L Lᵀ. Those of φ are X_i × them and are
  /// kept for the current group only.
  double* y = nullptr;
  /// [block of the group][6][3][kBatch]: all of Y.
  double* y_group = nullptr;
  std::size_t group_begin = 0;
  /// [batch][shared.blocks][6][3][kBatch]: N L⁻ᵀ.
  double* y_shared = nullptr;
  /// [batch][kFactorRows][kBatch]: L⁻¹ (6), z = L⁻¹ e_P (3), minimum depth, 0.
  double* factors = nullptr;

  /// [pose][classes][kPoseSums][kBatch].
  double* sums = nullptr;
  /// [pose][camera][kIntrinsicsSize][6][kBatch]: Σ JᵀwB.
  double* intrinsic_sums = nullptr;
  /// [camera][kIntrinsicsSize][kIntrinsicsSize + 1][kBatch]: Σ JᵀwJ, Σ Jᵀwε.
  double* intrinsic_own = nullptr;
  /// [reduced block][6][kBatch]: Σ Y z.
  double* reduced = nullptr;
  /// [slot][kBatch], output of evaluate(); may be null.
  float* squared = nullptr;

  /// Number of cameras whose normal equations are summed separately.
  int classes = 1;
  std::uint8_t class_cameras[kMaxCameras] = {};
  /// True if a camera has distortion or free intrinsics.
  bool lenses = false;

  SharedLayout shared;
  int free_poses = 0;
  BundleLoss loss = BundleLoss::none;
  /// Squared threshold of the loss, in squared sigmas.
  double threshold2 = 1;
  double damping = 0;

  /// Output: Σ ρ / 2 over the visited batches.
  double cost = 0;
  /// Output: Σ |ε|², in px².
  double squared_px = 0;
  /// Output: Σ w |ε|²/σ².
  double weighted = 0;
  /// Output of back_substitute(): Σ |δ|² and Σ |X|² of the points.
  double update = 0;
  double norm = 0;
  /// Output: true if an observed point is behind its camera.
  bool behind = false;
};

/// A set of parameters: the best so far, or the one being tried.
struct BundleState {
  std::span<Transform> poses;
  /// [batch][3][kBatch].
  std::span<double> points;
  Transform T_camera_left[kMaxCameras];
  Camera cameras[kMaxCameras];
};

/// Outputs of linearise() and subtract_points() that all batches add to.
struct BundleSums {
  std::span<double> y_group, sums, intrinsic_sums, intrinsic_own, reduced, A;
};

/// Memory of one adjuster, laid out once for its capacities.
struct BundleWorkspace : BundleSums {
  BundleCapacities capacity;
  std::size_t block_capacity = 0, slot_capacity = 0, reduced_capacity = 0;

  /// Points with observations as (first pose, last pose, index).
  std::span<std::uint64_t> order;
  /// First observation of each point, with one more element at the end.
  std::span<std::uint32_t> first_observation;
  std::span<std::uint32_t> pose_observations;
  /// Buffers of the set-up: first slot of each pose in the batch, and its cameras.
  std::span<std::uint32_t> pose_slot;
  std::span<std::uint8_t> pose_cameras;
  /// slot · kBatch + lane of each observation.
  std::span<std::uint32_t> observation_lane;
  std::span<Batch> batches;
  std::span<PoseBlock> blocks;
  std::span<Slot> slots;
  std::span<KernelPose> poses;
  std::span<double> point_free, y, y_shared, factors, rhs, delta;
  std::span<float> squared;
  BundleState states[2];
  /// Null if all batches are summed in turn, else the second half of them has sums of its own.
  PairRunner* runner = nullptr;
  BundleSums second_half;

  /// Sizes of the current problem; points have observations.
  std::size_t batch_count = 0, block_count = 0, slot_count = 0, point_count = 0;
  int free_poses = 0;
};

}  // namespace vergence::detail
