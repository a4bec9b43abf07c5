#include "app/checkerboard/charuco.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "app/checkerboard/tag_corners.hpp"

namespace vergence::app {
namespace {

static_assert(cv::aruco::DICT_4X4_50 == 0 &&
              cv::aruco::DICT_APRILTAG_36h11 == kMarkerDictionaries.size() - 1);

constexpr std::size_t kMinMarkers = 4;
constexpr double kFlatToSide = 0.2;   // mean residual of a flat board: more is another layout
constexpr double kWindowOfGap = 0.8;  // half window: a wider one meets the marker's corner
constexpr int kNarrowestWindow = 2, kWidestWindow = 8;  // px, half windows
constexpr double kMaxMoved = 0.25;  // of a square: what two markers extrapolate is nearer than that

struct Marker {
  int id = 0;
  std::array<cv::Point2d, 4> corners;  // from the upper left on, clockwise on the board
};

/// Each id once: a marker seen twice is a reflection or somebody's second board.
std::vector<Marker> detect(const cv::Mat& image, const BoardPattern& board) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(image, dictionary, corners, ids);
  std::vector<Marker> markers;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (std::count(ids.begin(), ids.end(), ids[i]) > 1) continue;
    Marker m{ids[i], {}};
    for (std::size_t k = 0; k < 4; ++k) m.corners[k] = corners[i][k];
    markers.push_back(m);
  }
  return markers;
}

/// Which squares have a marker, and which one.
class Layout {
 public:
  Layout(const BoardPattern& board, bool black_first)
      : columns_(board.columns + 1),
        rows_(board.rows + 1),
        square_(board.square),
        marker_(board.marker) {
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        if (((row + column) % 2 == 0) != black_first) squares_.push_back({column, row});
  }

  /// The upper left corner of a marker's square; nothing: the board has no such marker.
  [[nodiscard]] std::optional<cv::Point> square(int id) const {
    if (id < 0 || static_cast<std::size_t>(id) >= squares_.size()) return std::nullopt;
    return squares_[static_cast<std::size_t>(id)];
  }
  /// Position of a marker in metres from the target's upper left edge.
  [[nodiscard]] std::array<cv::Point2d, 4> corners(cv::Point square) const {
    const double gap = (square_ - marker_) / 2;
    const cv::Point2d at(square.x * square_ + gap, square.y * square_ + gap);
    return {at, at + cv::Point2d(marker_, 0), at + cv::Point2d(marker_, marker_),
            at + cv::Point2d(0, marker_)};
  }
  /// Index of an inner corner, by squares from the board's upper left edge; nothing: at the edge.
  [[nodiscard]] std::optional<std::size_t> inner(cv::Point corner) const {
    if (corner.x < 1 || corner.y < 1 || corner.x >= columns_ || corner.y >= rows_)
      return std::nullopt;
    return static_cast<std::size_t>((corner.y - 1) * (columns_ - 1) + corner.x - 1);
  }

 private:
  int columns_, rows_;  // squares
  double square_, marker_;
  std::vector<cv::Point> squares_;  // by id
};

/// Those that the board has. Its dictionary may have more: somebody's label on the wall.
std::vector<Marker> of_board(const std::vector<Marker>& markers, const Layout& layout) {
  std::vector<Marker> own;
  std::copy_if(markers.begin(), markers.end(), std::back_inserter(own),
               [&](const Marker& m) { return layout.square(m.id).has_value(); });
  return own;
}

/// Residual of the target's markers; infinite if there are too few.
double misfit(const std::vector<Marker>& markers, const Layout& layout) {
  if (markers.size() < kMinMarkers) return std::numeric_limits<double>::infinity();
  std::vector<cv::Point2d> on_board, in_image;
  for (const Marker& m : markers) {
    const auto corners = layout.corners(*layout.square(m.id));
    on_board.insert(on_board.end(), corners.begin(), corners.end());
    in_image.insert(in_image.end(), m.corners.begin(), m.corners.end());
  }
  return homography_misfit(on_board, in_image);
}

/// Where the inner corners of the markers' squares are, by each marker's own perspective; the mean
/// where two markers meet.
BoardCorners extrapolated(const std::vector<Marker>& markers, const Layout& layout, double square) {
  struct Sum {
    Vec2 pixel = Vec2::Zero();
    int n = 0;
  };
  std::map<std::size_t, Sum> sums;
  for (const Marker& m : markers) {
    const cv::Point at = *layout.square(m.id);
    std::array<cv::Point2f, 4> from, to;
    const auto corners = layout.corners(at);
    for (std::size_t k = 0; k < 4; ++k) from[k] = corners[k], to[k] = m.corners[k];
    const cv::Mat H = cv::getPerspectiveTransform(from.data(), to.data());
    for (const cv::Point step :
         {cv::Point(0, 0), cv::Point(1, 0), cv::Point(1, 1), cv::Point(0, 1)}) {
      const auto index = layout.inner(at + step);
      if (!index) continue;
      const std::vector<cv::Point2d> on_board{cv::Point2d(at + step) * square};
      std::vector<cv::Point2d> in_image;
      cv::perspectiveTransform(on_board, in_image, H);
      Sum& sum = sums[*index];
      sum.pixel += Vec2(in_image[0].x, in_image[0].y);
      ++sum.n;
    }
  }
  BoardCorners rough;
  for (const auto& [index, sum] : sums) rough.push_back({index, sum.pixel / sum.n});
  return rough;
}

double mean_side(const std::vector<Marker>& markers) {
  double sum = 0;
  for (const Marker& m : markers)
    for (std::size_t k = 0; k < 4; ++k) sum += cv::norm(m.corners[k] - m.corners[(k + 1) % 4]);
  return sum / static_cast<double>(4 * markers.size());
}

}  // namespace

BoardCorners find_charuco(const ImageView& image, const BoardPattern& board) {
  if (image.empty()) return {};
  const cv::Mat pixels = matrix_of(image);
  const std::vector<Marker> all = detect(pixels, board);
  const std::array<Layout, 2> layouts{Layout(board, true), Layout(board, false)};
  // One layout may have a marker more than the other.
  const std::array<std::vector<Marker>, 2> own{of_board(all, layouts[0]),
                                               of_board(all, layouts[1])};
  const std::array<double, 2> misfits{misfit(own[0], layouts[0]), misfit(own[1], layouts[1])};
  const std::size_t best = misfits[1] < misfits[0] ? 1 : 0;
  const std::vector<Marker>& markers = own[best];
  const double side = mean_side(markers);
  if (!(misfits[best] < kFlatToSide * side)) return {};
  const double square = side * board.square / board.marker;  // px
  const int window = std::clamp(static_cast<int>(kWindowOfGap * (square - side) / 2),
                                kNarrowestWindow, kWidestWindow);
  return refine_corners(pixels, extrapolated(markers, layouts[best], board.square), window,
                        kMaxMoved * square);
}

}  // namespace vergence::app
