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

/// Checks of the images of one frame.
struct ImageCheck {
  std::uint8_t given = 0;       // bit k: camera k delivered an image
  std::uint8_t structured = 0;  // bit k: and it shows something of this frame
  bool repeated = false;  // a camera gave its last image or the left one's once more: noise makes
                          // that impossible
  bool left_repeated = false;  // the left one is among them
  bool uneven = false;         // one repeated an image while another gave a new one
};

/// Result of stereo matching for the corners of one frame.
struct StereoCount {
  int corners = 0;
  int matched = 0;              // in front of the rig
  int near = 0;                 // of these, with a disparity that measures depth
  EpipolarEvidence evidence{};  // by their distances from the epipolar lines
};

/// A match between the left and another image found without knowing the rig: ideal pixels.
struct FreeMatch {
  Vec2 left = Vec2::Zero(), other = Vec2::Zero();
  double sigma = 0;  // px
};

/// Pixels of one rig frame: pyramids, following points, new corners and their stereo matches.
///
/// Ownership  Reads the frame's images until the next begin(). Options, rig and runner are the
///            owner's.
/// Threads    One caller; the runner takes the cameras but `left` to its other side. Results do not
///            depend on it.
/// Masks      Where one hides a pixel, or comes nearer than a window's half, nothing is found,
///            followed or matched.
/// Memory     From the arena at construction. When the map has no room for a new point, the weakest
///            corners are dropped.
class FrontEnd {
 public:
  /// Fingerprint of the coarsest level, equal for equal images. Equal sums alone occur by chance
  /// twice an hour on a rig that stands at 30 Hz; the hash over positions and grey values excludes
  /// that.
  struct Fingerprint {
    std::int64_t sum = 0, square = 0;
    std::uint64_t hash = 0;
    bool operator==(const Fingerprint&) const = default;
  };

  /// `masks` by camera, read here only: 0 is hidden; fewer than cameras, or empty ones: nothing is.
  /// Precondition: as large as the images.
  FrontEnd(const OdometryOptions& options, const RigCalibration& rig, Arena& arena,
           PairRunner& runner, std::span<const ImageView> masks = {});
  [[nodiscard]] static std::size_t memory_needed(const OdometryOptions& options,
                                                 const RigCalibration& rig,
                                                 std::span<const ImageView> masks = {}) noexcept;

  /// Builds the pyramids of a frame's images.
  [[nodiscard]] ImageCheck begin(const RigFrame& frame) noexcept;

  /// Follows a spread sample of about `sample` active points from a rough prediction, from pyramid
  /// level `coarsest` down: it may be off by some 8·2^coarsest px.
  void follow_sample(Map& map, const Transform& T_left_world, int sample, int coarsest) noexcept;
  /// Follows every followed point into every structured camera from a good prediction.
  void follow_all(Map& map, const Transform& T_left_world) noexcept;

  /// The owner's rig has other intrinsics than before.
  void rebuild_lenses() noexcept;
  /// Half width of the band about the epipolar line, px, from now on.
  void set_band(double px) noexcept { band_px_ = px; }

  /// Looks for the map's points in camera k wherever they may be, by what they look like. Answers
  /// how many seem found; their observations there, wrong ones among them, are rough; those in
  /// other cameras stay. Some milliseconds: for frames that tracking has lost.
  [[nodiscard]] int relocalise(Map& map, int k) noexcept;

  /// Corners of `left`, or blobs (OdometryOptions::init_features), found in camera k with nothing
  /// known of the rig but that it does not turn the image by more than some 20°: mutually best
  /// descriptors, then aligned. Wrong ones are among them. Some ten milliseconds, with blobs three
  /// times that. Valid until the next call.
  [[nodiscard]] std::span<const FreeMatch> match_free(int k) noexcept;

  /// New corners of `left` where the map has no points, matched across; null: as if there were no
  /// map. As many as there is room for, by the effort, and `min_corners` so many whatever that is.
  [[nodiscard]] StereoCount match_new(const Map* map, const FrameWorkload& effort = {},
                                      int min_corners = 0) noexcept;
  /// Weighs the distances of this frame's points from the epipolar lines between the first two
  /// cameras.
  [[nodiscard]] EpipolarEvidence weigh_points(const Map& map) noexcept;
  /// Adds the matches of the last match_new() to the map as points of the given stage, each with
  /// its observation in `now`.
  void add_points(const Transform& T_left_world, PointStage stage, Map* map) noexcept;

  /// The corners of the last match_new() fit the rig with its cameras exchanged better than as it
  /// is. Its matches are lost.
  [[nodiscard]] bool exchanged() noexcept;

  [[nodiscard]] const UndistortedCamera& lens(int k) const noexcept {
    return lenses_[static_cast<std::size_t>(k)];
  }
  /// Nothing is looked for at this pixel of camera k.
  [[nodiscard]] bool hides(int k, const Vec2& pixel) const noexcept {
    return masks_[static_cast<std::size_t>(k)].hides(pixel);
  }
  [[nodiscard]] float detect_ms() const noexcept { return detect_ms_; }

 private:
  /// Minimum correlation of two windows to be compared further. The epipolar distance, the ratio to
  /// the second best and the following frames decide whether they match. The value is
  /// the best of a trial over thirteen sequences.
  static constexpr float kMayMatch = 0.7F;
  static constexpr int kSmallestCell =
      12;  // px: a window's side; nearer corners share their pixels

  struct Followed {
    bool found = false;
    Eigen::Vector2f raw{}, ideal{};
    float sigma = 0;
  };
  struct NewPoint {
    bool usable = false;
    int matched_camera = 0;
    double rho = 0;        // 1/m
    double disparity = 0;  // px between here and a point at infinity
    float distance = 0;    // px from the epipolar line
    Vec3 ray{};
    Mat2 d_ray_d_pixel{};
    features::Patch patch{};
    Followed left, stereo;
  };

  [[nodiscard]] Followed follow(const MapPoint& p, const Transform& T_left_world, int k,
                                const features::AlignOptions& how) const noexcept;
  void follow_into_all(Map& map, const Transform& T_left_world, const features::AlignOptions& how,
                       int stride) noexcept;
  /// `by_noise`: AlignResult::sigma, px for one grey level.
  /// `parallax`: how far this camera stands from where the patch was cut, over the depth there:
  /// what its unknown slope can do.
  [[nodiscard]] bool finish(int k, const Vec2& raw, double by_noise, double parallax,
                            Followed* f) const noexcept;
  void match_stereo(const features::Corner& corner, bool exchanged, NewPoint* out) const noexcept;
  [[nodiscard]] features::CornerOptions corner_options(int k) const noexcept;
  /// Corners of camera k four times as dense as points are: so that most of the other image's have
  /// their partner.
  void find_dense_corners(int k) noexcept;
  void match_corners_freely(int k) noexcept;
  /// Aligns a rough match and keeps it if that succeeds and there is room.
  void keep_free_match(const features::Patch& patch, const RoughMatch& rough, int k) noexcept;
  void match_all(std::span<const features::Corner> corners, bool exchanged) noexcept;
  /// Weighs the epipolar distances of the matches whose disparity exceeds `min_disparity`.
  [[nodiscard]] EpipolarEvidence weigh(double min_disparity) noexcept;
  /// Where camera k sits is known, if only roughly: before, its transform is the identity.
  [[nodiscard]] bool placed(int k) const noexcept {
    return k == 0 || rig_.T_camera_left[static_cast<std::size_t>(k)].t.squaredNorm() > 0;
  }
  /// Null: camera k has none.
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
  std::array<Fingerprint, kMaxCameras> fingerprints_{};  // of the last images
  std::array<UndistortedCamera, kMaxCameras> lenses_{};
  std::array<features::Mask, kMaxCameras> masks_{};
  std::array<features::Pyramid, kMaxCameras> pyramids_{};
  std::array<std::span<Followed>, kMaxCameras> followed_{};
  BoundedVector<features::Corner> corners_, taken_;
  std::span<NewPoint> fresh_;
  BoundedVector<float> distances_;  // from epipolar lines, of what is weighed
  std::span<features::Descriptor>
      described_;  // of the map's points in relocalise(), of dense corners in match_free()
  BoundedVector<FreeMatch> free_matches_;
  BlobMatcher blobs_;  // has no memory unless asked for
  double band_px_;
  float detect_ms_ = 0;
};

}  // namespace vergence::odometry
