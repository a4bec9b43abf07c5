#pragma once
#include <opencv2/core.hpp>

#include "app/checkerboard/board_pattern.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

enum class BoardSearch : std::uint8_t {
  /// For images from files.
  thorough,
  /// For live images: gives up soon if there is no target.
  quick,
};

/// True with at least six corners (or all of a smaller target) and two rows with two corners each:
/// no three of those four are collinear. Without a homography OpenCV throws for that view and for
/// all views together.
[[nodiscard]] bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board);

/// Detects the target in an image: of a checkerboard all corners or none, of an AprilGrid or a
/// ChArUco board the visible ones if they determine a homography. `reference` has the corners in
/// another camera of the rig with the same orientation at the same time; it resolves a symmetric
/// target. May be empty.
[[nodiscard]] BoardCorners find_board(const ImageView& image, const BoardPattern& board,
                                      BoardSearch search, const BoardCorners& reference);

/// Corners of the checkerboard in an image to about 0.1 px, in the order of BoardPattern::corner().
/// The first corner follows from the squares' colours if these are unambiguous, else from
/// `reference`. Empty unless all corners are visible.
///
/// Uses OpenCV's findChessboardCorners, and cornerSubPix with a window that fits the smallest
/// visible square; a wider one would reach over the next corner.
[[nodiscard]] BoardCorners find_checkerboard(const ImageView& image, const BoardPattern& board,
                                             BoardSearch search,
                                             const BoardCorners& reference = {});

/// Corners of the visible tags to about 0.1 px; a part of the target is enough. Empty for fewer
/// than four tags (or not all, of a smaller target), or tags that do not match the rows and
/// columns.
///
/// Tags by the AprilTag library, family 36h11 with a black border of one or, as Kalibr prints them,
/// two cells; corners by OpenCV's cornerSubPix within the gap between tags. Tag 0 may be at the
/// lower left (Kalibr) or at the upper left.
[[nodiscard]] BoardCorners find_aprilgrid(const ImageView& image, const BoardPattern& board,
                                          BoardSearch search);

/// Inner corners of a ChArUco board next to a visible marker, to about 0.1 px; a part of the target
/// is enough. Empty for fewer than four markers, or markers that do not match the squares.
///
/// Markers by OpenCV's aruco module; corners from adjacent markers, then by cornerSubPix within the
/// gap between marker and square. Markers are numbered row by row from the top, in the white
/// squares. The upper left square may be black (as printed since OpenCV 4.7) or, with an even
/// number of rows, white (before); the image determines which.
[[nodiscard]] BoardCorners find_charuco(const ImageView& image, const BoardPattern& board);

// ---- shared by the detectors

/// Mean distance in px between points in an image and those of a flat target; infinite without a
/// homography.
[[nodiscard]] double homography_misfit(const std::vector<cv::Point2d>& on_board,
                                       const std::vector<cv::Point2d>& in_image);

/// Moves corners to the saddles of the image within the window.
void to_saddles(const cv::Mat& image, int half_window, std::vector<cv::Point2f>* corners);

/// Refines `rough` corners (pixel centres at integers) to saddle points by OpenCV's cornerSubPix in
/// windows of 2 `half_window` + 1 px. Drops corners near the image's edge or moved by more than
/// `max_moved` px. Ordered by index.
[[nodiscard]] BoardCorners refine_corners(const cv::Mat& image, const BoardCorners& rough,
                                          int half_window, double max_moved);

/// Wraps the pixels without copying; they must not be written.
[[nodiscard]] cv::Mat to_mat(const ImageView& image);

}  // namespace vergence::app
