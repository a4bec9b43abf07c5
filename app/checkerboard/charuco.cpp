#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <limits>

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>

namespace vergence::app {
namespace {

static_assert(cv::aruco::DICT_4X4_50 == 0 &&
              cv::aruco::DICT_APRILTAG_36h11 == kMarkerDictionaries.size() - 1);

constexpr std::size_t kMinMarkers = 4;
// Maximum mean residual over a marker's side. A larger one indicates another layout.
constexpr double kMaxMisfit = 0.2;
// Half window over the gap. A wider window meets the marker's corner.
constexpr double kWindowOfGap = 0.8;
// Limits of the half window in px.
constexpr int kMinWindow = 2, kMaxWindow = 8;
// Maximum correction as a fraction of a square's side.
constexpr double kMaxMoved = 0.25;

struct Markers {
  std::vector<int> ids;
  // The corners start at the upper left and run clockwise.
  std::vector<std::vector<cv::Point2f>> corners;

  [[nodiscard]] double mean_side() const {
    double sum = 0;
    for (const auto& c : corners) sum += cv::arcLength(c, true) / 4;
    return sum / static_cast<double>(corners.size());
  }
};

/// Markers that lie as on OpenCV's board, and their residual; infinite if there are too few.
double misfit(const Markers& markers, const cv::aruco::CharucoBoard& board, Markers* own) {
  std::vector<cv::Point2d> on_board, in_image;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    const auto at = std::ranges::find(board.ids, markers.ids[i]);
    if (at == board.ids.end()) continue;
    own->ids.push_back(markers.ids[i]);
    own->corners.push_back(markers.corners[i]);
    for (const cv::Point3f& p : board.objPoints[static_cast<std::size_t>(at - board.ids.begin())])
      on_board.emplace_back(p.x, p.y);
    in_image.insert(in_image.end(), markers.corners[i].begin(), markers.corners[i].end());
  }
  return own->ids.size() < kMinMarkers ? std::numeric_limits<double>::infinity()
                                       : homography_misfit(on_board, in_image);
}

}  // namespace

BoardCorners find_charuco(const ImageView& image, const BoardPattern& board) {
  if (image.empty()) return {};
  const cv::Mat pixels = to_mat(image);
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
  Markers found, all;
  cv::aruco::detectMarkers(pixels, dictionary, found.corners, found.ids);
  // A marker that is seen twice is a reflection or another board: both are left out.
  for (std::size_t i = 0; i < found.ids.size(); ++i)
    if (std::ranges::count(found.ids, found.ids[i]) == 1) {
      all.ids.push_back(found.ids[i]);
      all.corners.push_back(found.corners[i]);
    }
  // OpenCV's board has its black square first. One that has a white square first is OpenCV's
  // without its first row.
  double least = std::numeric_limits<double>::infinity();
  Markers markers;
  cv::Ptr<cv::aruco::CharucoBoard> layout;
  int first_corner = 0;
  for (const int missing_rows : {0, 1}) {
    auto next = cv::aruco::CharucoBoard::create(board.columns + 1, board.rows + 1 + missing_rows,
                                                static_cast<float>(board.square),
                                                static_cast<float>(board.marker), dictionary);
    for (int& id : next->ids) id -= missing_rows * ((board.columns + 1) / 2);
    Markers own;
    if (const double m = misfit(all, *next, &own); m < least) {
      least = m;
      markers = own;
      layout = next;
      first_corner = missing_rows * board.columns;
    }
  }
  if (!layout || !(least < kMaxMisfit * markers.mean_side())) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  (void)cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, pixels, layout, corners,
                                             ids, cv::noArray(), cv::noArray(), 1);
  BoardCorners rough;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (ids[i] >= first_corner)
      rough.push_back(
          {static_cast<std::size_t>(ids[i] - first_corner), Vec2(corners[i].x, corners[i].y)});
  // Sides of a marker and a square in px.
  const double side = markers.mean_side(), square = side * board.square / board.marker;
  const int window =
      std::clamp(static_cast<int>(kWindowOfGap * (square - side) / 2), kMinWindow, kMaxWindow);
  return refine_corners(pixels, rough, window, kMaxMoved * square);
}

}  // namespace vergence::app
