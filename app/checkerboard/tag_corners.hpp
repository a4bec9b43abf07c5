#pragma once
#include <vector>

#include <opencv2/core.hpp>

#include "app/checkerboard/board_pattern.hpp"
#include "core/types/image.hpp"

/// Shared parts of targets with coded tags.
namespace vergence::app {

/// Mean distance, px, of points in an image to those of a flat board; infinite where no homography
/// is found.
[[nodiscard]] double homography_misfit(const std::vector<cv::Point2d>& on_board,
                                       const std::vector<cv::Point2d>& in_image);

/// To the saddle points near `rough` (centres of pixels at integers), by OpenCV's cornerSubPix in
/// windows of 2 `half_window` + 1 px. Corners too near to the image's edge, and those that would go
/// farther than `max_moved` px, are left out; in order of index.
[[nodiscard]] BoardCorners refine_corners(const cv::Mat& image, const BoardCorners& rough,
                                          int half_window, double max_moved);

/// Wraps the pixels without copying; they must not be written.
[[nodiscard]] cv::Mat to_mat(const ImageView& image);

}  // namespace vergence::app
