#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace vergence::app {
namespace {

// From this image width in px on, squares may be too large for the windows of the detector.
constexpr int kLargeImage = 1200;
// Limits of the half window in px.
constexpr int kNarrowestWindow = 2, kWidestWindow = 11;
// Half window over the smallest distance between two corners.
constexpr double kWindowOfSquare = 0.3;

double smallest_spacing(const std::vector<cv::Point2f>& corners, const BoardPattern& board) {
  const auto n = static_cast<std::size_t>(board.columns);
  double least = 1e9;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if ((i + 1) % n != 0) least = std::min(least, cv::norm(corners[i + 1] - corners[i]));
    if (i + n < corners.size()) least = std::min(least, cv::norm(corners[i + n] - corners[i]));
  }
  return least;
}

bool detect(const cv::Mat& image, const BoardPattern& board, BoardSearch search,
            std::vector<cv::Point2f>* corners) {
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE |
                    (search == BoardSearch::quick ? cv::CALIB_CB_FAST_CHECK : 0);
  const cv::Size size(board.columns, board.rows);
  if (image.cols < kLargeImage) return cv::findChessboardCorners(image, size, *corners, flags);
  cv::Mat half;
  cv::resize(image, half, {}, 0.5, 0.5, cv::INTER_AREA);
  if (cv::findChessboardCorners(half, size, *corners, flags)) {
    for (cv::Point2f& c : *corners)
      // Pixel centres are at integer coordinates.
      c = 2 * c + cv::Point2f(0.5F, 0.5F);
    return true;
  }
  return search == BoardSearch::thorough && cv::findChessboardCorners(image, size, *corners, flags);
}

/// Rows run to the right when columns run down: a board seen from its front.
void make_right_handed(const BoardPattern& board, std::vector<cv::Point2f>* corners) {
  const auto n = static_cast<std::ptrdiff_t>(board.columns);
  const cv::Point2f along = corners->at(static_cast<std::size_t>(n - 1)) - corners->front();
  const cv::Point2f down =
      corners->at(corners->size() - static_cast<std::size_t>(n)) - corners->front();
  if (along.cross(down) > 0) return;
  for (auto row = corners->begin(); row != corners->end(); row += n) std::reverse(row, row + n);
}

/// Positive where the square right and below of the first corner is brighter than its neighbours.
double first_square_brighter(const cv::Mat& image, const BoardPattern& board,
                             const std::vector<cv::Point2f>& corners) {
  const auto n = static_cast<std::size_t>(board.columns);
  double sum = 0;
  for (std::size_t row = 0; row + 1 < static_cast<std::size_t>(board.rows); ++row)
    for (std::size_t col = 0; col + 1 < n; ++col) {
      const std::size_t i = row * n + col;
      const cv::Point2f c =
          0.25F * (corners[i] + corners[i + 1] + corners[i + n] + corners[i + n + 1]);
      const int x = std::clamp(static_cast<int>(std::lround(c.x)), 0, image.cols - 1);
      const int y = std::clamp(static_cast<int>(std::lround(c.y)), 0, image.rows - 1);
      sum += ((row + col) % 2 == 0 ? 1.0 : -1.0) * image.at<std::uint8_t>(y, x);
    }
  return sum;
}

/// True if the corners are those of a board that is rotated by 180°.
bool is_upside_down(const cv::Mat& image, const BoardPattern& board,
                    const std::vector<cv::Point2f>& corners, const BoardCorners& reference) {
  if (board.is_asymmetric()) return first_square_brighter(image, board, corners) < 0;
  if (reference.empty()) return false;
  const Vec2 there = reference.back().pixel - reference.front().pixel;
  const cv::Point2f here = corners.back() - corners.front();
  return there.dot(Vec2(here.x, here.y)) < 0;
}

}  // namespace

BoardCorners find_checkerboard(const ImageView& image, const BoardPattern& board,
                               BoardSearch search, const BoardCorners& reference) {
  if (image.empty()) return {};
  const cv::Mat pixels = to_mat(image);
  std::vector<cv::Point2f> corners;
  if (!detect(pixels, board, search, &corners) || corners.size() != board.corners()) return {};
  const int window =
      std::clamp(static_cast<int>(kWindowOfSquare * smallest_spacing(corners, board)),
                 kNarrowestWindow, kWidestWindow);
  to_saddles(pixels, window, &corners);
  make_right_handed(board, &corners);
  if (is_upside_down(pixels, board, corners, reference)) std::ranges::reverse(corners);
  BoardCorners found;
  found.reserve(corners.size());
  for (const cv::Point2f& c : corners) found.push_back({found.size(), Vec2(c.x, c.y)});
  return found;
}

}  // namespace vergence::app
