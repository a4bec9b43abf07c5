#include "core/features/corners.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <map>
#include <utility>

#include "core/features/detail/corner_kernel.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using namespace test;

constexpr int kWidth = 333, kHeight = 247;

SequentialRunner in_order;

struct Found {
  std::vector<Corner> storage;
  BoundedVector<Corner> corners;
  Found(const ImageView& image, const CornerOptions& options, std::span<const Corner> taken = {},
        std::size_t room = 1000, PairRunner& runner = in_order)
      : storage(room), corners(storage) {
    find_corners(image, options, taken, runner, &corners);
  }
};

/// OpenCV's least eigenvalues in our unit: its gradient is twice ours and in units of 255 grey
/// levels.
cv::Mat reference_scores(const Image& image) {
  const cv::Mat grey(image.height, image.width, CV_8U,
                     const_cast<std::uint8_t*>(image.bytes.data()),
                     static_cast<std::size_t>(image.stride));
  cv::Mat scores;
  cv::cornerMinEigenVal(grey, scores, 7, 1);
  return scores * (255.0 * 255.0 / 4.0);
}

Image textured() { return draw(kWidth, kHeight, Texture(5)); }

std::pair<int, int> cell_of(const Corner& c, int cell) {
  return {static_cast<int>(c.x) / cell, static_cast<int>(c.y) / cell};
}

TEST(Corners, scoresMatchOpenCvOnEveryTarget) {
  // 49 products of up to 127² are summed in floats, seven by seven: relative error below 14 · 2⁻²⁴
  // of the trace, which is at most 2 · 127².
  constexpr float kRounding = 14.F * 6e-8F * 2.F * 127.F * 127.F;
  for (const Image& image : {textured(), white_noise(kWidth, kHeight, 6)}) {
    const cv::Mat expected = reference_scores(image);
    test::on_every_target([&](const char* target) {
      constexpr int kX = 21, kY = 17, kBlockWidth = 77, kBlockHeight = 50;
      alignas(64) std::array<float, detail::kMaxBlock * detail::kMaxBlock> scores{};
      std::array<float, detail::kMaxBlock> bound{};
      detail::corner_scores(image.view(), kX, kY, kBlockWidth, kBlockHeight, scores.data(),
                            bound.data());
      float worst = 0;
      for (int y = 0; y < kBlockHeight; ++y) {
        const float* row = scores.data() + y * detail::kMaxBlock;
        EXPECT_GE(bound[static_cast<std::size_t>(y)], *std::max_element(row, row + kBlockWidth));
        for (int x = 0; x < kBlockWidth; ++x)
          worst = std::max(worst, std::abs(row[x] - expected.at<float>(kY + y, kX + x)));
      }
      EXPECT_LT(worst, kRounding) << target;
    });
  }
}

TEST(Corners, cornerIsTheStrongestPeakOfItsCell) {
  const Image image = textured();
  const cv::Mat scores = reference_scores(image);
  CornerOptions options{.min_distance = 0};
  const Found found(image.view(), options);
  ASSERT_GT(found.corners.size(), 40U);
  for (const Corner& c : found.corners.span()) {
    const int x = static_cast<int>(c.x), y = static_cast<int>(c.y);
    EXPECT_NEAR(c.score, scores.at<float>(y, x), 1e-3F * c.score);
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        EXPECT_GE(c.score * 1.001F, scores.at<float>(y + dy, x + dx));
    // No pixel of the cell that is a peak too is stronger.
    const auto [column, row] = cell_of(c, options.cell);
    for (int v = std::max(row * options.cell, options.border);
         v < std::min((row + 1) * options.cell, kHeight - options.border); ++v)
      for (int u = std::max(column * options.cell, options.border);
           u < std::min((column + 1) * options.cell, kWidth - 28); ++u) {
        const float s = scores.at<float>(v, u);
        if (s <= c.score * 1.001F) continue;
        float around = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx)
            around =
                std::max(around, (dx != 0 || dy != 0) ? scores.at<float>(v + dy, u + dx) : 0.F);
        EXPECT_GT(around * 1.001F, s) << "a stronger peak at " << u << ", " << v;
      }
  }
}

TEST(Corners, cornersAreSortedApartAndInsideTheBorder) {
  const Image image = white_noise(kWidth, kHeight, 2);
  CornerOptions options{.cell = 24, .border = 19, .min_distance = 15};
  const Found found(image.view(), options);
  ASSERT_GT(found.corners.size(), 30U);
  std::map<std::pair<int, int>, int> cells;
  for (std::size_t i = 0; i < found.corners.size(); ++i) {
    const Corner& c = found.corners[i];
    EXPECT_EQ(++cells[cell_of(c, options.cell)], 1);
    if (i > 0) {
      EXPECT_GE(found.corners[i - 1].score, c.score);
    }
    EXPECT_GE(c.x, 19);
    EXPECT_GE(c.y, 19);
    EXPECT_LT(c.x, kWidth - 19);
    EXPECT_LT(c.y, kHeight - 19);
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_GE(std::hypot(c.x - found.corners[k].x, c.y - found.corners[k].y), 15.F);
  }
}

TEST(Corners, occupiedCellsGetNoCorner) {
  const Image image = textured();
  CornerOptions options;
  const Found all(image.view(), options);
  // Every second one is taken: the rest must stay what they were, for they kept their distance
  // before.
  std::vector<Corner> taken;
  for (std::size_t i = 0; i < all.corners.size(); i += 2) taken.push_back(all.corners[i]);
  const Found rest(image.view(), options, taken);
  for (const Corner& c : rest.corners.span())
    for (const Corner& t : taken) {
      EXPECT_NE(cell_of(c, options.cell), cell_of(t, options.cell));
      EXPECT_GE(std::hypot(c.x - t.x, c.y - t.y), options.min_distance);
    }
  std::size_t still_there = 0;
  for (std::size_t i = 1; i < all.corners.size(); i += 2)
    for (const Corner& c : rest.corners.span())
      still_there += c.x == all.corners[i].x && c.y == all.corners[i].y ? 1U : 0U;
  EXPECT_EQ(still_there, all.corners.size() / 2);
}

TEST(Corners, limitedCapacityDropsTheWeakest) {
  const Image image = textured();
  const Found all(image.view(), {}), few(image.view(), {}, {}, 7);
  ASSERT_EQ(few.corners.size(), 7U);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(few.corners[i].score, all.corners[i].score);
}

TEST(Corners, flatImageOrEdgeHasNoCorner) {
  EXPECT_EQ(
      Found(draw(kWidth, kHeight, [](const Vec2&) { return 90.0; }).view(), {}).corners.size(), 0U);
  const Image edge = draw(kWidth, kHeight, [](const Vec2& p) {
    return 128 + 60 * std::tanh((p.x() - 0.4 * p.y() - 100) / 2.0);
  });
  // Rounding to whole grey levels leaves a third of a level: far below the threshold.
  EXPECT_EQ(Found(edge.view(), {}).corners.size(), 0U);
}

TEST(Corners, noByteOutsideTheImageIsRead) {
  for (const auto guard : {test::GuardedImage::Guard::before, test::GuardedImage::Guard::behind})
    for (const int border : {0, 5, 16}) {
      const test::GuardedImage image(white_noise(131, 99, 3), guard);
      CornerOptions options{.border = border};
      test::on_every_target(
          [&](const char*) { EXPECT_GT(Found(image.view(), options).corners.size(), 0U); });
    }
}

TEST(Corners, tooSmallOrEmptyImageHasNoCorner) {
  EXPECT_EQ(Found(white_noise(20, 20, 1).view(), {}).corners.size(), 0U);
  EXPECT_EQ(Found(ImageView{}, {}).corners.size(), 0U);
}

}  // namespace
}  // namespace vergence::features
