#include "app/report/svg.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/math/random.hpp"
#include "tests/unit/app/report/xml_check.hpp"

namespace vergence::app::report {
namespace {

TEST(Escape, keepsValidUtf8AndReplacesInvalid) {
  EXPECT_EQ(escape("Brücke 15° 😀"), "Brücke 15° 😀");
  const std::string mark = "\xEF\xBF\xBD";
  EXPECT_EQ(escape("a\xff"
                   "b"),
            "a" + mark + "b");
  // The character is cut off.
  EXPECT_EQ(escape("\xc3"), mark);
  // This is an overlong slash.
  EXPECT_EQ(escape("\xc0\xaf"), mark + mark);
  // This is a surrogate.
  EXPECT_EQ(escape("\xed\xa0\x80"), mark + mark + mark);
  // This is beyond Unicode.
  EXPECT_EQ(escape("\xf4\x90\x80\x80"), mark + mark + mark + mark);
}

TEST(Ticks, areRoundFewAndWithinAxis) {
  for (const auto& [low, high] : {std::pair{0.0, 1.0},
                                  {-3.7, 12.9},
                                  {1e-7, 3e-7},
                                  {0.0, 9.6e11},
                                  {-750.1, -749.8},
                                  {5.0, 5.0}}) {
    const auto ticks = nice_ticks(low, high, 6);
    ASSERT_FALSE(ticks.empty());
    EXPECT_LE(ticks.size(), 8U);
    for (const double t : ticks) {
      EXPECT_GE(t, low - 1e-6 * (high - low));
      EXPECT_LE(t, high + 1e-6 * (high - low));
    }
  }
  EXPECT_EQ(nice_ticks(0, 10, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(time_ticks(0, 1650, 6), (std::vector<double>{0, 300, 600, 900, 1200, 1500}));
}

TEST(SvgElement, isWellFormedForAnyInput) {
  Svg svg(100, 50, "a \"quoted\" <name>");
  svg.line("axis", 0, 0, std::nan(""), 1);
  svg.rect("f-ours", 1, 2, -3, 4);
  svg.lines("curve", {{{0, 1}}, {{0, 1}, {2, 3}, {4, 5}}});
  svg.polygon("f-ink", {{0, 0}, {1, 1}, {2, 0}});
  svg.text("strong", Anchor::end, 3, 4, "</text><script>");
  const std::string text = std::move(svg).finish();
  EXPECT_EQ(test::xml_problem({text}), "");
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("<script"), std::string::npos);
  EXPECT_NE(text.find("d=\"M0 1h0M0 1L2 3 4 5\""), std::string::npos) << text;
}

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

TEST(Decimate, keepsExtremesFirstAndLastOfColumn) {
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

TEST(Thin, omittedPointsAreWithinStepOfKeptOnes) {
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

}  // namespace
}  // namespace vergence::app::report
