#pragma once

#include <opencv2/core.hpp>

#include "app/checkerboard/board_pattern.hpp"
#include "core/types/image.hpp"

/// Shared parts of targets with coded tags.
namespace vergence::app {

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
