#include "app/report/svg.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/report/style.hpp"
#include "tests/unit/app/report/xml_check.hpp"

namespace vergence::app::report {
namespace {

TEST(Escape, markupBecomesText) {
  EXPECT_EQ(escape("<script>alert(\"1\" & '2')</script>"),
            "&lt;script&gt;alert(&quot;1&quot; &amp; &#39;2&#39;)&lt;/script&gt;");
  EXPECT_EQ(escape("a\nb\x1b[31m\x7f"), "a b [31m ");
}

TEST(Escape, goodUtf8StaysAndBrokenIsReplaced) {
  EXPECT_EQ(escape("Brücke 15° 😀"), "Brücke 15° 😀");
  const std::string mark = "\xEF\xBF\xBD";
  EXPECT_EQ(escape("a\xff"
                   "b"),
            "a" + mark + "b");
  EXPECT_EQ(escape("\xc3"), mark);                                   // cut off
  EXPECT_EQ(escape("\xc0\xaf"), mark + mark);                        // overlong /
  EXPECT_EQ(escape("\xed\xa0\x80"), mark + mark + mark);             // surrogate
  EXPECT_EQ(escape("\xf4\x90\x80\x80"), mark + mark + mark + mark);  // beyond Unicode
}

TEST(Escape, longTextIsCutAtAWholeCharacter) {
  EXPECT_EQ(escape(std::string(1000, 'x'), 5), "xxxxx…");
  EXPECT_EQ(escape("äää", 3), "ä…");
  EXPECT_EQ(escape("abc", 3), "abc");
}

TEST(Coordinate, isShortAndAlwaysANumber) {
  EXPECT_EQ(coordinate(1.26), "1.3");
  EXPECT_EQ(coordinate(3.0), "3");
  EXPECT_EQ(coordinate(-0.01), "0");
  EXPECT_EQ(coordinate(std::nan("")), "0");
  EXPECT_EQ(coordinate(std::numeric_limits<double>::infinity()), "0");
  EXPECT_EQ(coordinate(1e300), "1000000");
}

TEST(Ticks, areRoundFewAndWithinTheAxis) {
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

TEST(Ticks, labelsHaveTheDecimalsTheyNeed) {
  EXPECT_EQ(tick_label(0.5, 0.1), "0.5");
  EXPECT_EQ(tick_label(-2, 1), "−2");
  EXPECT_EQ(tick_label(1e-17, 0.1), "0.0");
  EXPECT_EQ(time_label(65, 5), "1:05");
  EXPECT_EQ(time_label(3723, 60), "1:02:03");
  EXPECT_EQ(time_label(4.5, 0.5), "4.5");
  EXPECT_EQ(duration_text(3599.7, 1), "1:00:00 h");
  EXPECT_EQ(duration_text(1.2e7, 1), "139 days");
}

TEST(SvgElement, isWellFormedWhateverGoesIn) {
  Svg svg(100, 50, "a \"quoted\" <name>");
  svg.line("axis", 0, 0, std::nan(""), 1);
  svg.rect("f-ours", 1, 2, -3, 4);
  svg.lines("curve", {{{0, 1}}, {{0, 1}, {2, 3}, {4, 5}}});
  svg.polygon("f-ink", {{0, 0}, {1, 1}, {2, 0}});
  svg.text("strong", Anchor::end, 3, 4, "</text><script>");
  const std::string text = std::move(svg).finish();
  EXPECT_EQ(test::XmlCheck::problem(text), "");
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("<script"), std::string::npos);
  EXPECT_NE(text.find("d=\"M0 1h0M0 1L2 3 4 5\""), std::string::npos) << text;
}

/// WCAG 2: relative luminance of #rrggbb.
double luminance(const char* colour) {
  const auto channel = [&](int k) {
    const double c =
        static_cast<double>(std::stoi(
            std::string(colour).substr(static_cast<std::size_t>(1 + 2 * k), 2), nullptr, 16)) /
        255;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * channel(0) + 0.7152 * channel(1) + 0.0722 * channel(2);
}

double contrast(const char* a, const char* b) {
  const double x = luminance(a), y = luminance(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

TEST(Colours, areReadableOnBothGroundsInBothThemes) {
  EXPECT_NEAR(contrast("#000000", "#ffffff"), 21, 1e-9);
  for (const Colour& c : kColours)
    for (const Colour& ground : {kPage, kPanel}) {
      const double requested = c.text ? 4.5 : 3.0;
      EXPECT_GE(contrast(c.light, ground.light), requested)
          << c.name << " on " << ground.name << ", light";
      EXPECT_GE(contrast(c.dark, ground.dark), requested)
          << c.name << " on " << ground.name << ", dark";
    }
}

}  // namespace
}  // namespace vergence::app::report
