#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/bundle/bundle.hpp"

namespace vergence::detail {

inline constexpr int kBatch =
    8;  // points worked on together: a cache line of doubles, the widest SIMD vector
inline constexpr int kBlock =
    6;  // rows of one pose in the reduced system; θ_S is padded to a multiple
inline constexpr int kYSize = kBlock * 3 * kBatch;  // doubles of one block of Y
inline constexpr int kYTop = 3 * 3 * kBatch;        // of its first three rows
inline constexpr int kFactorRows = 11;              // of PointFactor
inline constexpr double kFar = 1e30;                // m: depth of a point that no camera sees
inline constexpr int kPoseSums = 27;                // 21 of the symmetric 6×6, 6 of the gradient
inline constexpr int kGroupLimit =
    16;  // batches multiplied together: one block of each, 18 kB, stays in the first-level cache
inline constexpr int kMaxShared = kBlock * (kMaxCameras - 1) + kIntrinsicsSize * kMaxCameras;
inline constexpr int kMaxSharedBlocks = (kMaxShared + kBlock - 1) / kBlock;
inline constexpr int kMaxCells = 8;  // a side of the image, of a covariance by cells
inline constexpr int kJetDepth = 8;
inline constexpr int kJetIntrinsics = 9;
inline constexpr int kJetRows =
    kJetIntrinsics + 2 * kIntrinsicsSize;  // G (6), ε (2), depth, ∂x/∂intrinsics (9 × 2)

/// Eight points' observations in one image; where inverse_sigma is 0 there is none.
struct alignas(kCacheLine) Slot {
  double x[kBatch], y[kBatch], inverse_sigma[kBatch];
};

/// One pose that sees at least one point of a batch: its images' slots follow each other from
/// `slot`, cameras ascending.
struct PoseBlock {
  std::uint32_t slot = 0;
  std::uint16_t pose = 0;
  std::uint8_t cameras = 0;  // bit k: camera k has a slot
};

struct Batch {
  std::uint32_t block_begin = 0, block_end = 0;
  std::uint32_t group = 0;  // batches of one group see the same poses
  std::uint32_t lanes = 0;
};

struct KernelPose {
  double R[9], t[3];        // row-major, T_left_world
  std::int32_t block = -1;  // its rows in the reduced system, −1: constant
};

struct KernelCamera {
  double R[9], t[3];  // row-major, T_camera_left
  double fx, fy, cx, cy;
  Eigen::Matrix<double, 3, 2, Eigen::RowMajor> basis;  // where τ may go with the exact length
  bool identity;
};

/// Rows of θ_S. Extrinsics of camera k: (τ, φ), or (β, φ) with τ = basis β; then free intrinsics of
/// each camera.
struct SharedLayout {
  int size = 0;                                   // rows used
  int blocks = 0;                                 // of kBlock rows, the last one padded
  int extrinsic[kMaxCameras] = {-1, -1, -1, -1};  // first row, −1: constant
  bool exact[kMaxCameras] = {};
  int intrinsic[kMaxCameras] = {-1, -1, -1, -1};
  int intrinsic_count[kMaxCameras] = {};
  std::uint8_t intrinsic_index[kMaxCameras][kIntrinsicsSize] = {};
};

using SharedMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxShared, kMaxShared>;
using SharedVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxShared, 1>;

/// Everything a kernel reads and writes; pointers into the adjuster's arena. Lane arrays are
/// [rows][kBatch].
struct KernelJob {
  const Batch* batches = nullptr;
  const PoseBlock* blocks = nullptr;
  const Slot* slots = nullptr;
  const KernelPose* poses = nullptr;
  KernelCamera cameras[kMaxCameras];
  const double* points = nullptr;      // [batch][3][kBatch]
  const double* point_free = nullptr;  // [batch][kBatch], 1 or 0
  const double* jets = nullptr;  // [slot of the batch][kJetRows][kBatch]; only for cameras with
                                 // distortion or free intrinsics
  double* candidate = nullptr;   // [batch][3][kBatch], out of back_substitute
  double* y = nullptr;  // [block][3][3][kBatch]: of Y = O L⁻ᵀ with P = L Lᵀ the rows of τ; those of
                        // φ are X_i × them, and kept for the group in hand alone
  double* y_group = nullptr;    // [block of the group][6][3][kBatch]: Y whole
  std::size_t group_begin = 0;  // block: the first of the group in hand
  double* y_shared = nullptr;   // [batch][shared.blocks][6][3][kBatch]: N L⁻ᵀ
  double* factors =
      nullptr;  // [batch][kFactorRows][kBatch]: L⁻¹ (6), z = L⁻¹ e_P (3), least depth, 0
  double* sums = nullptr;            // [pose][classes][kPoseSums][kBatch]
  double* intrinsic_sums = nullptr;  // [pose][camera][kIntrinsicsSize][6][kBatch]: Σ JᵀwB
  double* intrinsic_own =
      nullptr;  // [camera][kIntrinsicsSize][kIntrinsicsSize + 1][kBatch]: Σ JᵀwJ, Σ Jᵀwε
  double* reduced = nullptr;  // [reduced block][6][kBatch]: Σ Y z
  float* squared = nullptr;   // [slot][kBatch], out of evaluate; may be null
  int classes = 1;            // cameras whose normal equations are summed apart
  std::uint8_t class_cameras[kMaxCameras] = {};
  SharedLayout shared;
  int free_poses = 0;
  BundleLoss loss = BundleLoss::none;
  double threshold2 = 1;  // of the loss, squared sigmas
  double damping = 0;

  double cost = 0;        // out: Σ ρ / 2 over what was visited
  double squared_px = 0;  // out: Σ |ε|², px²
  double weighted = 0;    // out: Σ w |ε|²/σ²
  double decrement = 0;   // out: Σ |z|²
  double update = 0;      // out of back_substitute: Σ |δ|² and Σ |X|² of the points
  double norm = 0;
  bool behind = false;  // out: an observed point is behind its camera
};

/// A set of parameters. Two of them: the best so far and the one being tried.
struct BundleState {
  std::span<Transform> poses;
  std::span<double> points;  // [batch][3][kBatch]
  Transform T_camera_left[kMaxCameras];
  Camera cameras[kMaxCameras];
};

/// All memory of one adjuster; sized by its capacities, laid out once.
struct BundleWorkspace {
  BundleCapacities capacity;
  std::size_t block_capacity = 0, slot_capacity = 0, reduced_capacity = 0;

  std::span<std::uint64_t> order;  // points with observations: (first pose, last pose, index)
  std::span<std::uint32_t> first_observation;  // of each point; as many as points + 1
  std::span<std::uint32_t> pose_observations;  // how many
  std::span<std::uint32_t>
      pose_slot;  // scratch of the set-up: first slot of each pose in the batch
  std::span<std::uint8_t> pose_cameras;       // scratch of the set-up
  std::span<std::uint32_t> observation_lane;  // of each observation: slot · kBatch + lane
  std::span<Batch> batches;
  std::span<PoseBlock> blocks;
  std::span<Slot> slots;
  std::span<KernelPose> poses;
  std::span<double> point_free, y, y_group, y_shared, factors, sums, intrinsic_sums, intrinsic_own,
      reduced, jets;
  std::span<double> A, rhs, delta;
  std::span<float> squared;
  BundleState states[2];

  std::size_t batch_count = 0, block_count = 0, slot_count = 0,
              point_count = 0;  // of the problem at hand; points with observations
  std::size_t free_points = 0;
  int free_poses = 0;
};

}  // namespace vergence::detail
