#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/report/decimation.hpp"
#include "app/report/plots.hpp"
#include "app/report/svg.hpp"

namespace vergence::app::report {
namespace {

constexpr double kMargin = 16, kFoot = 38, kLeast = 190,
                 kMost = 420;  // of the paper; kFoot: room for the scale bar
constexpr double kThin = 0.4;  // of the paper: finer than the line is wide
constexpr std::size_t kMostPoints = 20'000;

struct Bounds {
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  bool any = false;
  void include(double x, double y) {
    if (!std::isfinite(x) || !std::isfinite(y)) return;
    if (!any) *this = {x, x, y, y, true};
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
};

/// From metres to the paper, one scale for both axes; up is up.
struct MapScale {
  double per_metre = 1, x_middle = 0, y_middle = 0, height = kLeast;
  [[nodiscard]] double x(double v) const { return kPlotWidth / 2 + (v - x_middle) * per_metre; }
  [[nodiscard]] double y(double v) const {
    return kMargin + (height - kMargin - kFoot) / 2 - (v - y_middle) * per_metre;
  }
};

MapScale scale_for(const Bounds& b) {
  constexpr double kSmallest =
      1;  // m: a vehicle that stands still is a dot, not its noise enlarged
  const double width = std::max(b.x1 - b.x0, kSmallest), depth = std::max(b.y1 - b.y0, kSmallest);
  MapScale s;
  s.per_metre = std::min((kPlotWidth - 2 * kMargin) / width, (kMost - kMargin - kFoot) / depth);
  s.height = std::clamp(depth * s.per_metre + kMargin + kFoot, kLeast, kMost);
  s.x_middle = (b.x0 + b.x1) / 2, s.y_middle = (b.y0 + b.y1) / 2;
  return s;
}

std::vector<double> placed(const std::vector<double>& values, const MapScale& s, bool vertical) {
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    out[i] = vertical ? s.y(values[i]) : s.x(values[i]);
  return out;
}

void draw_path(const char* css, const std::vector<double>& x, const std::vector<double>& y,
               const std::vector<std::uint8_t>& breaks, const MapScale& s, Svg* svg) {
  const std::vector<double> on_x = placed(x, s, false), on_y = placed(y, s, true);
  svg->lines(css, thin(on_x, on_y, breaks, kThin, kMostPoints));
}

/// Our way also breaks off where the drive was placed on the earth anew: that step was not driven.
std::vector<std::uint8_t> breaks_of_ours(const Analysis& a) {
  std::vector<std::uint8_t> breaks = a.breaks;
  for (std::size_t i = 0; i < std::min(breaks.size(), a.placed_anew.size()); ++i)
    if (a.placed_anew[i] != 0) breaks[i] = 1;
  return breaks;
}

/// Where the path breaks off because there was no pose, a small red mark.
void draw_breaks(const Analysis& a, const MapScale& s, Svg* svg) {
  constexpr double kApart = 6;  // of the paper: marks nearer than that say the same
  Point last{-1e9, -1e9};
  for (std::size_t i = 1; i < a.ours_x.size(); ++i) {
    const bool ends =
        std::isfinite(a.ours_x[i - 1]) && (!std::isfinite(a.ours_x[i]) || a.breaks[i] != 0);
    if (!ends) continue;
    const Point p{s.x(a.ours_x[i - 1]), s.y(a.ours_y[i - 1])};
    if (std::hypot(p.x - last.x, p.y - last.y) < kApart) continue;
    svg->lines("curve s-bad", {{{p.x - 4, p.y - 4}, {p.x + 4, p.y + 4}},
                               {{p.x - 4, p.y + 4}, {p.x + 4, p.y - 4}}});
    last = p;
  }
}

/// Degraded stretches lie over the path in their own colour.
void draw_degraded(const Analysis& a, std::span<const Frame> frames, const MapScale& s, Svg* svg) {
  std::vector<double> x = a.ours_x;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (frames[i].status != PoseStatus::degraded) x[i] = kNone;
  draw_path("curve map-care s-care", x, a.ours_y, breaks_of_ours(a), s, svg);
}

void draw_ends(const Analysis& a, const MapScale& s, Svg* svg) {
  const auto there = [&a](std::size_t i) { return std::isfinite(a.ours_x[i]); };
  std::size_t first = 0, last = a.ours_x.size();
  while (first < last && !there(first)) ++first;
  if (first == last) return;
  while (!there(last - 1)) --last;
  svg->circle("f-ours", s.x(a.ours_x[first]), s.y(a.ours_y[first]), 4.5);
  const double x = s.x(a.ours_x[last - 1]), y = s.y(a.ours_y[last - 1]);
  svg->rect("f-ours", x - 4, y - 4, 8, 8);
}

void draw_scale_bar(const MapScale& s, Svg* svg) {
  const auto ticks = nice_ticks(0, 150 / s.per_metre, 2);
  const double metres = ticks.size() > 1 ? ticks[1] : 1;
  const double y = s.height - 14, length = metres * s.per_metre;
  svg->lines("curve s-ink",
             {{{kMargin, y - 5}, {kMargin, y}, {kMargin + length, y}, {kMargin + length, y - 5}}});
  const std::string words =
      metres >= 1000 ? fmt::format("{:g} km", metres / 1000) : fmt::format("{:g} m", metres);
  svg->text("strong", Anchor::start, kMargin + length + 8, y + 1, words);
}

void draw_north(const MapScale& s, Svg* svg) {
  const double x = kPlotWidth - kMargin - 8, y = s.height - 12;
  svg->polygon("f-ink", {{x, y - 22}, {x + 6, y}, {x, y - 5}, {x - 6, y}});
  svg->text("strong", Anchor::end, x - 12, y - 2, "north");
}

}  // namespace

std::string map_picture(const Analysis& analysis, std::span<const Frame> frames) {
  Bounds bounds;
  for (std::size_t i = 0; i < analysis.ours_x.size(); ++i) {
    bounds.include(analysis.ours_x[i], analysis.ours_y[i]);
    bounds.include(analysis.theirs_x[i], analysis.theirs_y[i]);
  }
  if (!bounds.any) return {};
  const MapScale scale = scale_for(bounds);
  Svg svg(kPlotWidth, scale.height, "The drive from above");
  draw_path("curve map-theirs s-theirs", analysis.theirs_x, analysis.theirs_y, analysis.breaks,
            scale, &svg);
  draw_path("curve map-ours s-ours", analysis.ours_x, analysis.ours_y, breaks_of_ours(analysis),
            scale, &svg);
  draw_degraded(analysis, frames, scale, &svg);
  draw_breaks(analysis, scale, &svg);
  draw_ends(analysis, scale, &svg);
  draw_scale_bar(scale, &svg);
  if (analysis.map_is_enu) draw_north(scale, &svg);
  return std::move(svg).finish();
}

}  // namespace vergence::app::report
