#include "app/report/decimation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/math/random.hpp"

namespace vergence::app::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Curve {
  std::vector<double> x, y;
};

Curve noise(std::size_t n) {
  Random random(5);
  Curve c;
  for (std::size_t i = 0; i < n; ++i) {
    c.x.push_back(static_cast<double>(i));
    c.y.push_back(random.normal());
  }
  return c;
}

std::size_t points(const std::vector<Line>& lines) {
  std::size_t n = 0;
  for (const Line& line : lines) n += line.size();
  return n;
}

TEST(Decimate, everyColumnKeepsItsExtremesItsFirstAndItsLastValue) {
  const Curve c = noise(33'000);
  constexpr int kColumns = 100;
  const auto lines = decimate(c.x, c.y, {}, 0, 33'000, kColumns);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_LE(lines[0].size(), 4U * kColumns);
  for (int column = 0; column < kColumns; ++column) {
    const auto begin = static_cast<std::size_t>(column) * 330, end = begin + 330;
    const auto [low, high] = std::minmax_element(c.y.begin() + static_cast<std::ptrdiff_t>(begin),
                                                 c.y.begin() + static_cast<std::ptrdiff_t>(end));
    const auto kept = [&](std::size_t i) {
      return std::any_of(lines[0].begin(), lines[0].end(),
                         [&](const Point& p) { return p.x == c.x[i] && p.y == c.y[i]; });
    };
    EXPECT_TRUE(kept(begin)) << column;
    EXPECT_TRUE(kept(end - 1)) << column;
    EXPECT_TRUE(kept(static_cast<std::size_t>(low - c.y.begin()))) << column;
    EXPECT_TRUE(kept(static_cast<std::size_t>(high - c.y.begin()))) << column;
  }
  EXPECT_TRUE(std::is_sorted(lines[0].begin(), lines[0].end(),
                             [](const Point& a, const Point& b) { return a.x < b.x; }));
}

TEST(Decimate, whereThereIsNoValueTheLineEnds) {
  Curve c = noise(10);
  c.y[0] = kNan, c.y[4] = kNan, c.y[5] = std::numeric_limits<double>::infinity(), c.y[7] = kNan;
  const auto lines = decimate(c.x, c.y, {}, 0, 10, 1000);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].front().x, 1);
  EXPECT_EQ(lines[0].back().x, 3);
  ASSERT_EQ(lines[1].size(), 1U);
  EXPECT_EQ(lines[1].front().x, 6);
  EXPECT_EQ(lines[2].front().x, 8);
}

TEST(Decimate, aBreakCutsEvenWithinAColumn) {
  const Curve c = noise(10);
  std::vector<std::uint8_t> breaks(10, 0);
  breaks[5] = 1;
  const auto lines = decimate(c.x, c.y, breaks, 0, 10, 1);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].back().x, 4);
  EXPECT_EQ(lines[1].front().x, 5);
}

TEST(Thin, noPointLeftOutIsFartherThanTheStepFromAPointKept) {
  Random random(3);
  Curve c;
  double x = 0, y = 0;
  for (int i = 0; i < 5000; ++i) {
    c.x.push_back(x += random.uniform(-0.3, 0.4));
    c.y.push_back(y += random.uniform(-0.3, 0.4));
  }
  const auto lines = thin(c.x, c.y, {}, 2.0, 100'000);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_LT(lines[0].size(), c.x.size() / 2);
  EXPECT_EQ(lines[0].back().x, c.x.back());
  for (std::size_t i = 0; i < c.x.size(); ++i) {
    double nearest = 1e9;
    for (const Point& p : lines[0])
      nearest = std::min(nearest, std::hypot(p.x - c.x[i], p.y - c.y[i]));
    ASSERT_LE(nearest, 2.0) << i;
  }
}

TEST(Thin, theCountIsBoundedHoweverLongTheWay) {
  Curve c = noise(20'000);
  for (double& v : c.y) v *= 1000;
  EXPECT_LE(points(thin(c.x, c.y, {}, 0.1, 500)), 500U);
}

}  // namespace
}  // namespace vergence::app::report
