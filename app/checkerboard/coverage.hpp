#pragma once

#include "app/checkerboard/board_calibration.hpp"

namespace vergence::app {

/// Coverage of the views so far: missing parts of each image, tilts, sizes and number.
///
/// Parts    Nine per image, the outer ones a third wide, because distortion is determined only
///          where corners are.
/// Tilts    Four directions of at least kTilt as seen by camera 0; without them focal length and
///          distance are not separable.
/// Sizes    Once as near as both cameras permit, once clearly further.
class Coverage {
 public:
  /// `names` and `sizes` are per camera. `focal_px` is the approximate focal length of camera 0,
  /// used only for the tilts.
  Coverage(const BoardPattern& board, std::vector<std::string> names, std::vector<ImageSize> sizes,
           double focal_px);

  void add(const BoardView& view);
  /// Returns true if a view adds a missing part, tilt or size.
  [[nodiscard]] bool brings_something(const BoardView& view) const;
  /// Describes missing coverage, most useful first: "left: top right and bottom", "the board's left
  /// edge nearer", "5 more views".
  [[nodiscard]] std::vector<std::string> needs() const;
  [[nodiscard]] std::size_t views() const noexcept { return views_; }

 private:
  static constexpr std::size_t kParts = 9, kTilts = 4;
  /// Maximum number of corners in each part of an image, over the views.
  using Seen = std::array<int, kParts>;
  /// Pose of the target in front of camera 0.
  struct Stand {
    // Largest share of the image's width or height.
    double extent = 0;
    // True for the right, left, bottom or top edge nearer.
    std::array<bool, kTilts> tilted{};
  };
  [[nodiscard]] Stand pose_bin(const BoardView& view) const;
  void count(const BoardView& view, std::size_t camera, Seen* seen) const;

  BoardPattern board_;
  std::vector<std::string> names_;
  std::vector<ImageSize> sizes_;
  double focal_px_;
  std::vector<Seen> seen_;
  std::array<bool, kTilts> tilted_{};
  // Values of Stand::extent.
  double nearest_ = 0, farthest_ = 1;
  std::size_t views_ = 0;
};

inline constexpr std::size_t kEnoughViews = 12;
/// Number of corners of one view in a part.
inline constexpr int kEnoughCorners = 6;
/// In rad (15°).
inline constexpr double kTilt = 0.26;
/// Share of the image.
inline constexpr double kNearExtent = 0.35;
/// Ratio of extents, far to near.
inline constexpr double kFarOfNear = 0.75;

enum class OfferResult : std::uint8_t {
  accepted,
  /// Camera 0, or every other camera, does not see the whole target.
  not_seen,
  /// The target has moved since the last set, or was not seen then; different exposures would
  /// deform it.
  moving,
  /// The view adds no coverage.
  nothing_new,
};

/// Selects from live images the views that a calibration needs. Not thread-safe. Allocates.
class ViewCollector {
 public:
  explicit ViewCollector(Coverage coverage, double image_width_px);

  /// Offers the corners of one set of images; sets must be consecutive.
  [[nodiscard]] OfferResult offer(const BoardView& seen);
  [[nodiscard]] const std::vector<BoardView>& views() const noexcept { return views_; }
  [[nodiscard]] const Coverage& coverage() const noexcept { return coverage_; }
  /// True if coverage is complete.
  [[nodiscard]] bool complete() const { return coverage_.needs().empty(); }

 private:
  [[nodiscard]] bool still(const BoardView& seen) const;
  [[nodiscard]] bool elsewhere(const BoardView& seen) const;

  Coverage coverage_;
  double still_px_, elsewhere_px_;
  BoardView last_{};
  std::vector<BoardView> views_{};
};

/// Mean motion of the corners between two sets relative to the image width: 1 px of 640.
inline constexpr double kStillOfWidth = 0.0015;
/// Mean distance of the corners to those of every accepted view, relative to the image width.
inline constexpr double kElsewhereOfWidth = 0.05;

}  // namespace vergence::app
