#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/features/corners.hpp"
#include "core/features/descriptor.hpp"
#include "core/features/mask.hpp"
#include "core/features/pyramid.hpp"
#include "core/geometry/epipolar_evidence.hpp"
#include "core/odometry/blob_matcher.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/options.hpp"
#include "core/odometry/undistorted_camera.hpp"
#include "core/types/frame_workload.hpp"
#include "core/types/parallel.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::odometry {

/// Margin of the image in px, in which points are not followed: half a row of a window in memory,
/// and one more.
inline constexpr double kImageMargin = 0.5 * features::kWindowStride + 1;

/// Checks of the images of one frame.
struct ImageCheck {
  /// Bit k is set if camera k delivered an image.
  std::uint8_t given = 0;
  /// Bit k is set if that image has structure and is from the left image's instant: it is a
  /// repeated image if and only if the left one is.
  std::uint8_t structured = 0;
  /// True if a camera delivered its previous image or the left one's again, which noise makes
  /// impossible for a new image.
  bool repeated = false;
  /// True if the left image is repeated.
  bool left_repeated = false;
  /// True if one camera repeated an image while another delivered a new one.
  bool uneven = false;
};

/// Result of stereo matching for the corners of one frame.
struct StereoCount {
  int corners = 0;
  /// Number of corners matched, in front of the rig.
  int matched = 0;
  /// Number of these whose disparity measures depth.
  int near = 0;
  /// Evidence from their distances to the epipolar lines.
  EpipolarEvidence evidence{};
};

/// A match between the left and another image, in ideal pixels, found without a known rig.
struct FreeMatch {
  Vec2 left = Vec2::Zero(), other = Vec2::Zero();
  /// Standard deviation of one coordinate, in pixels.
  double sigma = 0;
};

/// Image processing of one rig frame: builds pyramids, follows points, detects corners and matches
/// them in stereo.
///
/// Ownership  Reads the frame's images until the next begin(). Options, rig and runner are the
///            owner's.
/// Threads    One caller; the runner takes part of the images and points. Results do not
///            depend on it.
/// Masks      Nothing is found, followed or matched within half a window of a masked pixel.
/// Memory     From the arena at construction. If the map has no room for new points, the weakest
///            corners are dropped.
class FrontEnd {
 public:
  /// Fingerprint of the coarsest level, equal for equal images. Sums alone coincide by chance twice
  /// an hour for a standing rig at 30 Hz, so it includes a hash over positions and grey values.
  struct Fingerprint {
    std::int64_t sum = 0, square = 0;
    std::uint64_t hash = 0;
    bool operator==(const Fingerprint&) const = default;
  };

  /// `masks`: one per camera, as large as the images, read here only; pixels are hidden where it is
  /// 0. Missing or empty masks hide nothing.
  FrontEnd(const OdometryOptions& options, const RigCalibration& rig, Arena& arena,
           PairRunner& runner, std::span<const ImageView> masks = {});

  /// Builds the pyramids of a frame's images.
  [[nodiscard]] ImageCheck begin(const RigFrame& frame) noexcept;

  /// Keeps this frame's left image as the one that turn_since_kept() compares with.
  void keep_left_image() noexcept;
  /// Rotation of the left camera since the kept image, by the shift of the whole image: rough, but
  /// up to a third of the field of view. Takes some milliseconds.
  [[nodiscard]] Mat3 turn_since_kept() const noexcept;

  /// Follows about `sample` evenly chosen active points from a rough prediction, which may be off
  /// by some 8·2^coarsest px, from pyramid level `coarsest` down.
  void follow_sample(Map& map, const Transform& T_left_world, int sample, int coarsest) noexcept;
  /// Follows every followed point into every structured camera from a good prediction.
  void follow_all(Map& map, const Transform& T_left_world) noexcept;

  /// Call when the intrinsics of the rig have changed.
  void rebuild_lenses() noexcept;
  /// Sets the half width of the search band around the epipolar line, in px.
  void set_band(double px) noexcept { band_px_ = px; }

  /// Searches for the map's points in the whole image of camera k by their descriptors. Returns the
  /// number of tentative matches, whose observations are rough and include wrong ones; those of
  /// other cameras stay. Takes some milliseconds.
  [[nodiscard]] int relocalise(Map& map, int k) noexcept;

  /// Matches corners of `left`, or blobs (OdometryOptions::init_features), in camera k without a
  /// known rig; its images may be rotated by up to about 20° relative to the left ones. Descriptors
  /// are mutually best and matches aligned; wrong ones remain. Takes about 10 ms, with blobs 30 ms.
  /// Valid until the next call.
  [[nodiscard]] std::span<const FreeMatch> match_free(int k) noexcept;

  /// Detects new corners of `left` where `map` has no points (null: everywhere). `effort` limits
  /// their number, but not below `min_corners`.
  void detect_new(const Map* map, const FrameWorkload& effort = {}, int min_corners = 0) noexcept;
  /// Matches the corners of the last detect_new() in stereo.
  [[nodiscard]] StereoCount match_new() noexcept;
  /// Evaluates the distances of this frame's points to the epipolar lines between the first two
  /// cameras.
  [[nodiscard]] EpipolarEvidence weigh_points(const Map& map) noexcept;
  /// Adds the matches of the last match_new() to the map as points of the given stage, each with
  /// its observation in `now`.
  void add_points(const Transform& T_left_world, PointStage stage, Map* map) noexcept;

  /// Returns true if the corners of the last match_new() fit the rig better with its cameras
  /// swapped. Discards the matches.
  [[nodiscard]] bool swapped() noexcept;

  [[nodiscard]] const std::array<UndistortedCamera, kMaxCameras>& lenses() const noexcept {
    return lenses_;
  }
  [[nodiscard]] const UndistortedCamera& lens(int k) const noexcept {
    return lenses_[static_cast<std::size_t>(k)];
  }
  /// True if the mask hides this pixel of camera k.
  [[nodiscard]] bool hides(int k, const Vec2& pixel) const noexcept {
    return masks_[static_cast<std::size_t>(k)].hides(pixel);
  }

 private:
  struct Followed {
    bool found = false;
    Eigen::Vector2f raw{}, ideal{};
    float sigma = 0;
  };
  struct NewPoint {
    bool usable = false;
    int matched_camera = 0;
    // Inverse depth, in 1/m.
    double rho = 0;
    // Distance in px from the projection of a point at infinity.
    double disparity = 0;
    // Distance from the epipolar line, in px.
    float distance = 0;
    Vec3 ray{};
    Mat2 d_ray_d_pixel{};
    features::Patch patch{};
    Followed left, stereo;
  };

  [[nodiscard]] Followed follow(const MapPoint& p, const Transform& T_left_world, int k,
                                const features::AlignOptions& how) const noexcept;
  /// Follows every stride-th active point, or with stride 1 every followed point.
  void follow_into_all(Map& map, const Transform& T_left_world, int coarsest, float max_shift,
                       int stride) noexcept;
  /// Undistorts a raw pixel and sets its sigma. `by_noise`: AlignResult::sigma, in px per grey
  /// level. `parallax`: distance of this camera from where the patch was cut, over the depth there,
  /// which weights the effect of the patch's unknown slope.
  [[nodiscard]] bool finish(int k, const Vec2& raw, double by_noise, double parallax,
                            Followed* f) const noexcept;
  void match_stereo(const features::Corner& corner, bool swapped, NewPoint* out) const noexcept;
  [[nodiscard]] features::CornerOptions corner_options(int k) const noexcept;
  /// Finds corners of camera k four times as dense as points, so that most corners of the other
  /// image have a partner.
  void find_dense_corners(int k) noexcept;
  void match_corners_freely(int k) noexcept;
  /// Aligns a rough match and keeps it if that succeeds and there is room.
  void keep_free_match(const features::Patch& patch, const RoughMatch& rough, int k) noexcept;
  void match_all(std::span<const features::Corner> corners, bool swapped) noexcept;
  /// Weighs `distances_`.
  [[nodiscard]] EpipolarEvidence weigh_distances() noexcept;
  /// Weighs the epipolar distances of the matches whose disparity exceeds `min_disparity`.
  [[nodiscard]] EpipolarEvidence weigh(double min_disparity) noexcept;
  /// True if camera k's transform is known at least roughly; before, it is the identity.
  [[nodiscard]] bool has_extrinsics(int k) const noexcept {
    return k == 0 || rig_.T_camera_left[static_cast<std::size_t>(k)].t.squaredNorm() > 0;
  }
  /// Mask of camera k, or null.
  [[nodiscard]] const features::Mask* mask(int k) const noexcept {
    const features::Mask& m = masks_[static_cast<std::size_t>(k)];
    return m.empty() ? nullptr : &m;
  }
  static void store(const Followed& f, int k, MapPoint* p) noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  PairRunner& runner_;
  int cameras_;
  std::uint8_t structured_ = 0;
  std::array<Fingerprint, kMaxCameras> fingerprints_{};
  std::array<UndistortedCamera, kMaxCameras> lenses_{};
  std::array<features::Mask, kMaxCameras> masks_{};
  std::array<features::Pyramid, kMaxCameras> pyramids_{};
  // Coarsest level of the left image that was kept.
  std::span<std::uint8_t> kept_;
  std::array<std::span<Followed>, kMaxCameras> followed_{};
  BoundedVector<features::Corner> corners_, taken_;
  std::span<NewPoint> fresh_;
  // Distances to epipolar lines, for weigh().
  BoundedVector<float> distances_;
  // Descriptors of the map's points in relocalise(), and of dense corners in match_free().
  std::span<features::Descriptor> described_;
  BoundedVector<FreeMatch> free_matches_;
  // Has no memory with init_features 0.
  BlobMatcher blobs_;
  double band_px_;
};

}  // namespace vergence::odometry
