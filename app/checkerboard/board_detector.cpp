#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace vergence::app {

bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board) {
  constexpr std::size_t kMinCorners = 6;
  if (corners.size() < std::min(kMinCorners, board.corners())) return false;
  std::map<double, int> in_row;
  for (const BoardCorner& c : corners) ++in_row[board.corner(c.index).y()];
  return std::ranges::count_if(in_row, [](const auto& row) { return row.second >= 2; }) >= 2;
}

BoardCorners find_board(const ImageView& image, const BoardPattern& board, BoardSearch search,
                        const BoardCorners& reference) try {
  const BoardCorners corners =
      board.kind == BoardKind::aprilgrid ? find_aprilgrid(image, board, search)
      : board.kind == BoardKind::charuco ? find_charuco(image, board)
                                         : find_checkerboard(image, board, search, reference);
  return determine_a_homography(corners, board) ? corners : BoardCorners();
} catch (const cv::Exception&) {
  // An image on which the detector throws contains no calibration target.
  return {};
}

double homography_misfit(const std::vector<cv::Point2d>& on_board,
                         const std::vector<cv::Point2d>& in_image) {
  const cv::Mat H = cv::findHomography(on_board, in_image);
  if (H.empty()) return std::numeric_limits<double>::infinity();
  std::vector<cv::Point2d> back;
  cv::perspectiveTransform(on_board, back, H);
  double sum = 0;
  for (std::size_t i = 0; i < back.size(); ++i) sum += cv::norm(back[i] - in_image[i]);
  return sum / static_cast<double>(back.size());
}

void to_saddles(const cv::Mat& image, int half_window, std::vector<cv::Point2f>* corners) {
  // Blur in px. The interpolation of the refinement shifts corners of sharper images.
  constexpr double kBlur = 0.7;
  constexpr int kSteps = 100;
  // Tolerance in px.
  constexpr double kTolerance = 1e-4;
  cv::Mat soft;
  cv::GaussianBlur(image, soft, {}, kBlur);
  cv::cornerSubPix(soft, *corners, {half_window, half_window}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kSteps, kTolerance});
}

BoardCorners refine_corners(const cv::Mat& image, const BoardCorners& rough, int half_window,
                            double max_moved) {
  const double margin = half_window + 2;
  BoardCorners corners;
  std::vector<cv::Point2f> fine;
  for (const BoardCorner& c : rough) {
    if (c.pixel.x() < margin || c.pixel.y() < margin || c.pixel.x() > image.cols - 1 - margin ||
        c.pixel.y() > image.rows - 1 - margin)
      continue;
    corners.push_back(c);
    fine.emplace_back(static_cast<float>(c.pixel.x()), static_cast<float>(c.pixel.y()));
  }
  if (fine.empty()) return {};
  to_saddles(image, half_window, &fine);
  BoardCorners refined;
  for (std::size_t i = 0; i < fine.size(); ++i)
    if (const Vec2 at(fine[i].x, fine[i].y); (at - corners[i].pixel).norm() <= max_moved)
      refined.push_back({corners[i].index, at});
  std::ranges::sort(refined,
                    [](const BoardCorner& a, const BoardCorner& b) { return a.index < b.index; });
  return refined;
}

cv::Mat to_mat(const ImageView& image) {
  // cv::Mat has no view of constant pixels.
  return {image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

}  // namespace vergence::app
