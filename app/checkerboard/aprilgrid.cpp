#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <limits>
#include <memory>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <opencv2/imgproc.hpp>

namespace vergence::app {
namespace {

// Number of wrong bits accepted of 36. Codes differ in at least 11 bits.
constexpr int kWrongBits = 1;
constexpr std::size_t kMinTags = 4;
// Half window over the gap between tags. A wider window meets the next tag's edge.
constexpr double kWindowOfGap = 0.4;
// Limits of the half window in px.
constexpr int kNarrowestWindow = 2, kWidestWindow = 8;
// Maximum correction in px. After growing twice, corners lie 2.8 px inside.
constexpr double kMaxRefined = 4;
// Maximum mean residual of a flat target over the tag's side. A larger one indicates another
// layout.
constexpr double kFlatToSide = 0.2;

struct Tag {
  std::size_t id = 0;
  // The corners are counter-clockwise on the calibration target.
  std::array<cv::Point2f, 4> corners{};
};

template <auto Destroy>
struct Deleter {
  void operator()(auto* held) const { Destroy(held); }
};
using Family = std::unique_ptr<apriltag_family_t, Deleter<tag36h11_destroy>>;

/// The family with a border of two black cells: the same bits, one cell farther in.
Family wide_border() {
  Family family(tag36h11_create());
  family->width_at_border += 2;
  family->total_width += 2;
  for (std::uint32_t i = 0; i < family->nbits; ++i) {
    ++family->bit_x[i];
    ++family->bit_y[i];
  }
  return family;
}

/// Detects tags. Made once: preparing the codes takes longer than an image.
class TagDetector {
 public:
  TagDetector() {
    apriltag_detector_add_family_bits(detector_.get(), narrow_.get(), kWrongBits);
    apriltag_detector_add_family_bits(detector_.get(), wide_.get(), kWrongBits);
  }

  /// Those of the border that more tags have, each id once.
  ///
  /// The squares touch the corners of the tags, which the library takes for one black shape. With
  /// white grown by `grow` px they come apart, and corners move in by as much.
  [[nodiscard]] std::vector<Tag> detect(const cv::Mat& image, int grow, std::size_t ids) {
    const int window = 2 * grow + 1;
    cv::dilate(image, grown_, cv::Mat::ones(window, window, CV_8U));
    image_u8_t pixels{grown_.cols, grown_.rows, static_cast<int>(grown_.step), grown_.data};
    const std::unique_ptr<zarray_t, Deleter<apriltag_detections_destroy>> found(
        apriltag_detector_detect(detector_.get(), &pixels));
    std::vector<Tag> narrow = of_family(*found, narrow_.get(), ids),
                     wide = of_family(*found, wide_.get(), ids);
    return wide.size() >= narrow.size() ? wide : narrow;
  }

 private:
  [[nodiscard]] static std::vector<Tag> of_family(const zarray_t& found,
                                                  const apriltag_family_t* family,
                                                  std::size_t ids) {
    std::vector<Tag> tags;
    for (int i = 0; i < zarray_size(&found); ++i) {
      apriltag_detection_t* d = nullptr;
      zarray_get(&found, i, &d);
      if (d->family != family || d->id < 0 || static_cast<std::size_t>(d->id) >= ids) continue;
      Tag tag{.id = static_cast<std::size_t>(d->id)};
      for (std::size_t k = 0; k < 4; ++k)
        tag.corners[k] = {static_cast<float>(d->p[k][0]), static_cast<float>(d->p[k][1])};
      tags.push_back(tag);
    }
    std::ranges::sort(tags, {}, &Tag::id);
    // A tag seen twice is a reflection or a second target: neither is used.
    std::vector<Tag> once;
    std::ranges::copy_if(tags, std::back_inserter(once), [&](const Tag& tag) {
      return std::ranges::count(tags, tag.id, &Tag::id) == 1;
    });
    return once;
  }

  cv::Mat grown_;
  Family narrow_{tag36h11_create()}, wide_ = wide_border();
  std::unique_ptr<apriltag_detector_t, Deleter<apriltag_detector_destroy>> detector_{
      apriltag_detector_create()};
};

/// Numbering of tags and their corners.
struct Layout {
  // True if tag 0 is at the lower left.
  bool from_below = true;
  // Corner i of the detection is corner i + turn of the tag.
  std::size_t turn = 0;

  [[nodiscard]] std::size_t index(const BoardPattern& board, std::size_t id,
                                  std::size_t corner) const {
    const auto columns = static_cast<std::size_t>(board.columns),
               rows = static_cast<std::size_t>(board.rows);
    const std::size_t row = from_below ? id / columns : rows - 1 - id / columns;
    return 4 * (row * columns + id % columns) + (corner + turn) % 4;
  }
};

double mean_side(const std::vector<Tag>& tags) {
  double sum = 0;
  for (const Tag& tag : tags)
    for (std::size_t k = 0; k < 4; ++k) sum += cv::norm(tag.corners[k] - tag.corners[(k + 1) % 4]);
  return sum / static_cast<double>(4 * tags.size());
}

}  // namespace

BoardCorners find_aprilgrid(const ImageView& image, const BoardPattern& board, BoardSearch search) {
  if (image.empty()) return {};
  // Each thread has its own detector, because threads process different cameras.
  thread_local TagDetector detector;
  const std::size_t ids = board.corners() / 4;
  const cv::Mat pixels = to_mat(image);
  std::vector<Tag> tags = detector.detect(pixels, 1, ids);
  // Large and blurred tags touch by more.
  if (search == BoardSearch::thorough && tags.size() < ids)
    if (std::vector<Tag> more = detector.detect(pixels, 2, ids); more.size() > tags.size())
      tags = std::move(more);
  if (tags.size() < std::min(kMinTags, ids)) return {};
  Layout best;
  double least = std::numeric_limits<double>::infinity();
  for (const bool from_below : {true, false})
    for (std::size_t turn = 0; turn < 4; ++turn) {
      // Residual of corners numbered like this.
      const Layout layout{from_below, turn};
      std::vector<cv::Point2d> on_board, in_image;
      for (const Tag& tag : tags)
        for (std::size_t k = 0; k < 4; ++k) {
          const Vec3 X = board.corner(layout.index(board, tag.id, k));
          on_board.emplace_back(X.x(), X.y());
          in_image.emplace_back(tag.corners[k]);
        }
      if (const double m = homography_misfit(on_board, in_image); m < least)
        least = m, best = layout;
    }
  if (!(least < kFlatToSide * mean_side(tags))) return {};
  // To the saddle between tag and square.
  const int window = std::clamp(static_cast<int>(kWindowOfGap * board.spacing * mean_side(tags)),
                                kNarrowestWindow, kWidestWindow);
  BoardCorners rough;
  for (const Tag& tag : tags)
    for (std::size_t k = 0; k < 4; ++k)
      // The library's pixels have their corner at integers.
      rough.push_back({best.index(board, tag.id, k),
                       Vec2(tag.corners[k].x, tag.corners[k].y) - Vec2(0.5, 0.5)});
  return refine_corners(pixels, rough, window, kMaxRefined);
}

}  // namespace vergence::app
