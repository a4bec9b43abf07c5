#include "app/report/plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "app/report/svg.hpp"
#include "core/math/angle.hpp"

namespace vergence::app::report {
namespace {

/// The box of a plot: where data lies on the paper, and its axes.
struct PlotBox {
  // Edges of the plot in the drawing.
  double left = 58, right = kPlotWidth - 12, top = 8, bottom = kPlotHeight - 36;
  // Range of the data, with x0 < x1 and y0 < y1.
  double x0 = 0, x1 = 1, y0 = 0, y1 = 1;

  [[nodiscard]] double x(double v) const noexcept {
    return left + (v - x0) / (x1 - x0) * (right - left);
  }
  [[nodiscard]] double y(double v) const noexcept {
    return bottom - (v - y0) / (y1 - y0) * (bottom - top);
  }
  [[nodiscard]] Line line(const Line& data) const {
    Line placed;
    placed.reserve(data.size());
    for (const Point& p : data) placed.push_back({x(p.x), y(p.y)});
    return placed;
  }
  void draw_time_axis(Svg* svg) const {
    constexpr int kMax = 6;
    const auto ticks = time_ticks(x0, x1, kMax);
    const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 1;
    for (const double t : ticks) {
      const double at = x(t);
      svg->line("tick", at, top, at, bottom);
      // The outer ones keep clear of the other axis's numbers and of the edge.
      const bool first = at<left + 14, last = at> right - 14;
      const Anchor anchor = first ? Anchor::start : last ? Anchor::end : Anchor::middle;
      svg->text("", anchor, first ? left - 3 : std::min(at, right + 10), bottom + 16,
                time_label(t, step));
    }
    svg->line("axis", left, bottom, right, bottom);
    svg->text("", Anchor::middle, (left + right) / 2, bottom + 32,
              x1 - x0 > 60 ? "time, min:s" : "time, s");
  }
  void draw_y_axis(Svg* svg) const {
    const auto ticks = nice_ticks(y0, y1, 5);
    const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : y1 - y0;
    for (const double t : ticks) {
      svg->line(t == 0.0 && y0 < 0 ? "axis" : "tick", left, y(t), right, y(t));
      svg->text("", Anchor::end, left - 6, y(t) + 4.5, tick_label(t, step));
    }
    svg->line("axis", left, top, left, bottom);
  }
  /// Sets y0 and y1 around values with some air; equal values get a box, too. from_zero: y0 is 0.
  void fit_y(double low, double high, bool from_zero) {
    if (from_zero) low = std::min(0.0, low);
    // Minimum range that doubles can resolve.
    const double least = std::max({std::abs(low), std::abs(high), 1e-6}) * 1e-6;
    const double air = std::max(0.06 * (high - low), least);
    y0 = from_zero && low == 0.0 ? 0.0 : low - air;
    y1 = high + air;
  }
};

// Number of columns of a curve, two per unit of the drawing, which is sharp on high-resolution
// screens.
constexpr int kColumns = 740;

std::vector<Line> on_paper(const PlotBox& box, const std::vector<Line>& lines) {
  std::vector<Line> placed;
  placed.reserve(lines.size());
  for (const Line& line : lines) placed.push_back(box.line(line));
  return placed;
}

/// Runs of frames without a pose as stripes behind a curve over time; runs in one pixel column
/// become one.
void draw_holes(const PlotBox& box, std::span<const double> time, std::span<const Frame> frames,
                Svg* svg) {
  double drawn_to = -1;
  for (std::size_t i = 0; i < frames.size();) {
    if (frames[i].posed) {
      ++i;
      continue;
    }
    const std::size_t begin = i;
    while (i < frames.size() && !frames[i].posed) ++i;
    const double from = std::max(box.x(time[begin]), drawn_to),
                 to = std::max(box.x(time[std::min(i, frames.size() - 1)]), from + 1);
    if (to <= drawn_to + 0.5) continue;
    svg->rect("hole", from, box.top, to - from, box.bottom - box.top);
    drawn_to = to;
  }
}

struct Lane {
  std::string name;
  const char* css;
  // A column is 1 if the status occurred in it.
  std::vector<std::uint8_t> columns;
};

constexpr double kLaneHeight = 21, kBandLeft = 148;

/// Marks the columns from the frame to the next one (or a frame interval where frames are missing).
void mark(Lane* lane, const PlotBox& box, const Analysis& a, std::size_t i) {
  const double from = a.time_s[i];
  const bool missing_after = i + 1 >= a.time_s.size() || a.breaks[i + 1] != 0;
  const double to = missing_after ? from + a.interval_s : a.time_s[i + 1];
  const auto last = static_cast<double>(lane->columns.size() - 1);
  const double scale = 1 / (box.right - box.left) * (last + 1);
  const double begin = std::clamp(std::floor((box.x(from) - box.left) * scale), 0.0, last);
  const double end = std::clamp(std::ceil((box.x(to) - box.left) * scale), begin + 1, last + 1);
  std::fill(lane->columns.begin() + static_cast<std::ptrdiff_t>(begin),
            lane->columns.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{1});
}

void draw_lane(const Lane& lane, const PlotBox& box, double top, Svg* svg) {
  const double unit = (box.right - box.left) / static_cast<double>(lane.columns.size());
  svg->text("strong", Anchor::end, box.left - 8, top + 13.5, lane.name);
  svg->rect("track", box.left, top + 3, box.right - box.left, kLaneHeight - 7);
  for (std::size_t i = 0; i < lane.columns.size();) {
    const std::size_t begin = i;
    while (i < lane.columns.size() && lane.columns[i] == lane.columns[begin]) ++i;
    if (lane.columns[begin] == 0) continue;
    svg->rect(lane.css, box.left + unit * static_cast<double>(begin), top + 3,
              std::max(1.0, unit * static_cast<double>(i - begin)), kLaneHeight - 7);
  }
}

constexpr std::array<const char*, 3> kStatusCss{"f-good", "f-care", "f-bad"};
constexpr std::array<const char*, 6> kStateCss{"f-care", "f-third",  "f-theirs",
                                               "f-ours", "f-fourth", "f-bad"};

std::vector<Lane> make_lanes(const Session& s, const Analysis& a, const PlotBox& box) {
  const auto columns = static_cast<std::size_t>(box.right - box.left) * 2;
  const auto empty = [columns](std::string_view name, const char* css) {
    return Lane{std::string(name), css, std::vector<std::uint8_t>(columns, 0)};
  };
  std::vector<Lane> lanes;
  for (std::size_t i = 0; i < 3; ++i)
    lanes.push_back(empty(to_string(static_cast<PoseStatus>(i)), kStatusCss[i]));
  std::array<std::optional<Lane>, 6> states;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const Frame& f = s.frames[i];
    mark(&lanes[static_cast<std::size_t>(f.status)], box, a, i);
    // The state and the status `lost` describe the same frames.
    if (f.state == State::lost) continue;
    auto& lane = states[static_cast<std::size_t>(f.state)];
    if (!lane) {
      std::string name(to_string(f.state));
      std::ranges::replace(name, '_', ' ');
      lane = empty(name, kStateCss[static_cast<std::size_t>(f.state)]);
    }
    mark(&*lane, box, a, i);
  }
  for (auto& lane : states)
    if (lane) lanes.push_back(std::move(*lane));
  return lanes;
}

void draw_events(const Session& s, const PlotBox& box, double top, Svg* svg) {
  svg->text("strong", Anchor::end, box.left - 8, top + 13.5, "events");
  svg->rect("track", box.left, top + 3, box.right - box.left, kLaneHeight - 7);
  double last = -1;
  for (const Event& e : s.events) {
    if (s.frames.empty() || e.stamp < s.frames.front().stamp || e.stamp > s.frames.back().stamp)
      continue;
    const double at = box.x(seconds_between(s.frames.front().stamp, e.stamp));
    if (std::abs(at - last) < 1) continue;
    svg->rect("f-ink", std::clamp(at - 1, box.left, box.right - 2), top + 3, 2, kLaneHeight - 7);
    last = at;
  }
}

constexpr double kMillimetres = 1e3;

/// A value of a calibration parameter and how long it was in use.
struct CalibrationValue {
  double from = 0, to = 0, value = 0;
  // 0 if unknown.
  double two_sigma = 0;
};

struct CalibrationCurve {
  std::vector<CalibrationValue> used, rejected, measured;
  [[nodiscard]] bool empty() const { return used.empty() && rejected.empty() && measured.empty(); }
};

CalibrationCurve calibration_curve(const Session& s, const Analysis& a, int camera, int component) {
  const double unit = component < 3 ? kDegreesPerRadian : kMillimetres;
  const auto k = static_cast<std::size_t>(component);
  CalibrationCurve curve;
  for (const CalibrationRow& c : s.calibrations) {
    if (c.camera != camera) continue;
    const double since = s.frames.empty() ? 0
                                          : (static_cast<double>(c.stamp.ns()) -
                                             static_cast<double>(s.frames.front().stamp.ns())) *
                                                1e-9;
    const double at = std::clamp(since, 0.0, a.duration_s);
    const CalibrationValue value{at, a.duration_s, c.value[k] * unit,
                                 c.has_sigma ? 2 * c.sigma[k] * unit : 0};
    if (c.accepted) {
      if (!curve.used.empty()) curve.used.back().to = at;
      curve.used.push_back(value);
    } else if (!c.kept) {
      curve.rejected.push_back({at, at, value.value, 0});
    } else if (std::isfinite(c.depth_sigma_percent)) {
      // A sigma that is not finite marks a failed solve, which is not drawn.
      curve.measured.push_back(value);
    }
  }
  return curve;
}

void fit_calibration(const CalibrationCurve& curve, PlotBox* box) {
  double low = 1e300, high = -1e300;
  for (const auto* values : {&curve.used, &curve.rejected, &curve.measured})
    for (const CalibrationValue& v : *values) {
      low = std::min(low, v.value - v.two_sigma);
      high = std::max(high, v.value + v.two_sigma);
    }
  box->fit_y(low, high, false);
}

void draw_calibration(const CalibrationCurve& curve, const PlotBox& box, Svg* svg) {
  Line steps;
  for (const CalibrationValue& v : curve.used) {
    const double high = box.y(v.value + v.two_sigma), low = box.y(v.value - v.two_sigma);
    if (v.two_sigma > 0)
      svg->rect("band", box.x(v.from), high, box.x(v.to) - box.x(v.from), low - high);
    steps.push_back({box.x(v.from), box.y(v.value)});
    steps.push_back({box.x(v.to), box.y(v.value)});
  }
  if (!steps.empty()) svg->lines("curve s-ours", {steps});
  for (const CalibrationValue& v : curve.used)
    svg->circle("f-ours", box.x(v.from), box.y(v.value), 2.6);
  for (const CalibrationValue& v : curve.measured) {
    const double x = box.x(v.from);
    if (v.two_sigma > 0)
      svg->line("whisker", x, box.y(v.value + v.two_sigma), x, box.y(v.value - v.two_sigma));
    svg->circle("seen", x, box.y(v.value), 2.8);
  }
  for (const CalibrationValue& v : curve.rejected)
    svg->circle("hollow", box.x(v.from), box.y(v.value), 3.2);
}

void draw_verification(double at_s, const PlotBox& box, Svg* svg) {
  const double x = box.x(at_s);
  svg->line("confirmed", x, box.top, x, box.bottom);
  const bool near_the_end = x > box.right - 60;
  svg->text("good", near_the_end ? Anchor::end : Anchor::start, x + (near_the_end ? -5 : 5),
            box.top + 11, "verified");
}

// Sizes in the drawing. kFoot is the room for the scale bar.
constexpr double kMargin = 16, kFoot = 38, kMin = 190, kMax = 420;
// Distance in the drawing that is smaller than the line width.
constexpr double kThin = 0.4;
constexpr std::size_t kMaxPoints = 20'000;

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
  double per_metre = 1, x_middle = 0, y_middle = 0, height = kMin;
  [[nodiscard]] double x(double v) const { return kPlotWidth / 2 + (v - x_middle) * per_metre; }
  [[nodiscard]] double y(double v) const {
    return kMargin + (height - kMargin - kFoot) / 2 - (v - y_middle) * per_metre;
  }
};

MapScale scale_for(const Bounds& b) {
  // Minimum extent in m, so that the noise of a vehicle at rest is not enlarged.
  constexpr double kSmallest = 1;
  const double width = std::max(b.x1 - b.x0, kSmallest), depth = std::max(b.y1 - b.y0, kSmallest);
  MapScale s;
  s.per_metre = std::min((kPlotWidth - 2 * kMargin) / width, (kMax - kMargin - kFoot) / depth);
  s.height = std::clamp(depth * s.per_metre + kMargin + kFoot, kMin, kMax);
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
  svg->lines(css, thin(on_x, on_y, breaks, kThin, kMaxPoints));
}

/// Our way also breaks off where the drive was placed on the earth anew: that step was not driven.
std::vector<std::uint8_t> breaks_of_estimate(const Analysis& a) {
  std::vector<std::uint8_t> breaks = a.breaks;
  for (std::size_t i = 0; i < std::min(breaks.size(), a.realigned.size()); ++i)
    if (a.realigned[i] != 0) breaks[i] = 1;
  return breaks;
}

/// Where the path breaks off because there was no pose, a small red mark.
void draw_breaks(const Analysis& a, const MapScale& s, Svg* svg) {
  // Distance in the drawing below which two marks are merged.
  constexpr double kApart = 6;
  Point last{-1e9, -1e9};
  for (std::size_t i = 1; i < a.estimate_x.size(); ++i) {
    const bool ends =
        std::isfinite(a.estimate_x[i - 1]) && (!std::isfinite(a.estimate_x[i]) || a.breaks[i] != 0);
    if (!ends) continue;
    const Point p{s.x(a.estimate_x[i - 1]), s.y(a.estimate_y[i - 1])};
    if (std::hypot(p.x - last.x, p.y - last.y) < kApart) continue;
    svg->lines("curve s-bad", {{{p.x - 4, p.y - 4}, {p.x + 4, p.y + 4}},
                               {{p.x - 4, p.y + 4}, {p.x + 4, p.y - 4}}});
    last = p;
  }
}

/// Degraded stretches lie over the path in their own colour.
void draw_degraded(const Analysis& a, std::span<const Frame> frames, const MapScale& s, Svg* svg) {
  std::vector<double> x = a.estimate_x;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (frames[i].status != PoseStatus::degraded) x[i] = kNone;
  draw_path("curve map-care s-care", x, a.estimate_y, breaks_of_estimate(a), s, svg);
}

void draw_ends(const Analysis& a, const MapScale& s, Svg* svg) {
  const auto there = [&a](std::size_t i) { return std::isfinite(a.estimate_x[i]); };
  std::size_t first = 0, last = a.estimate_x.size();
  while (first < last && !there(first)) ++first;
  if (first == last) return;
  while (!there(last - 1)) --last;
  svg->circle("f-ours", s.x(a.estimate_x[first]), s.y(a.estimate_y[first]), 4.5);
  const double x = s.x(a.estimate_x[last - 1]), y = s.y(a.estimate_y[last - 1]);
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

/// From the first frame to the last along x.
[[nodiscard]] static PlotBox time_box(const Analysis& a) {
  PlotBox box;
  // The range is never empty.
  box.x1 = a.duration_s > 0 ? a.duration_s : 1;
  return box;
}

std::string curve_plot(const CurvePlot& plot, const Analysis& analysis,
                       std::span<const Frame> frames) {
  PlotBox box = time_box(analysis);
  double low = 0, high = 0;
  bool any = false;
  for (const double v : plot.y) {
    if (!std::isfinite(v)) continue;
    low = any ? std::min(low, v) : v;
    high = any ? std::max(high, v) : v;
    any = true;
  }
  if (!any) return {};
  box.fit_y(low, high, plot.from_zero);
  Svg svg(kPlotWidth, kPlotHeight, plot.description);
  draw_holes(box, analysis.time_s, frames, &svg);
  box.draw_time_axis(&svg);
  box.draw_y_axis(&svg);
  svg.lines(plot.css, on_paper(box, decimate(analysis.time_s, plot.y, analysis.breaks, box.x0,
                                             box.x1, kColumns)));
  return std::move(svg).finish();
}

std::string bands_plot(const Session& session, const Analysis& analysis) {
  if (analysis.read == 0) return {};
  PlotBox box = time_box(analysis);
  box.left = kBandLeft;
  box.top = 2;
  const std::vector<Lane> lanes = make_lanes(session, analysis, box);
  constexpr std::size_t kStatuses = 3;
  // Distance between statuses, states and events.
  constexpr double kApart = 8;
  const double events_top = box.top + kLaneHeight * static_cast<double>(lanes.size()) + 2 * kApart;
  box.bottom = events_top + kLaneHeight;
  Svg svg(kPlotWidth, box.bottom + 36,
          "Status of the frames, state of the estimator and events over time");
  for (std::size_t i = 0; i < lanes.size(); ++i)
    draw_lane(lanes[i], box,
              box.top + kLaneHeight * static_cast<double>(i) + (i >= kStatuses ? kApart : 0), &svg);
  draw_events(session, box, events_top, &svg);
  box.draw_time_axis(&svg);
  return std::move(svg).finish();
}

std::string calibration_plot(const Session& session, const Analysis& analysis, int camera,
                             int component) {
  const CalibrationCurve curve = calibration_curve(session, analysis, camera, component);
  if (curve.empty()) return {};
  PlotBox box = time_box(analysis);
  // The left margin has room for four decimals.
  box.left = 74;
  fit_calibration(curve, &box);
  Svg svg(kPlotWidth, kPlotHeight, "A calibration parameter over time with its 2 sigma band");
  box.draw_time_axis(&svg);
  box.draw_y_axis(&svg);
  if (analysis.verified_s) draw_verification(*analysis.verified_s, box, &svg);
  draw_calibration(curve, box, &svg);
  return std::move(svg).finish();
}

std::string map_plot(const Analysis& analysis, std::span<const Frame> frames) {
  Bounds bounds;
  for (std::size_t i = 0; i < analysis.estimate_x.size(); ++i) {
    bounds.include(analysis.estimate_x[i], analysis.estimate_y[i]);
    bounds.include(analysis.reference_x[i], analysis.reference_y[i]);
  }
  if (!bounds.any) return {};
  const MapScale scale = scale_for(bounds);
  Svg svg(kPlotWidth, scale.height, "Trajectory seen from above");
  draw_path("curve map-theirs s-theirs", analysis.reference_x, analysis.reference_y,
            analysis.breaks, scale, &svg);
  draw_path("curve map-ours s-ours", analysis.estimate_x, analysis.estimate_y,
            breaks_of_estimate(analysis), scale, &svg);
  draw_degraded(analysis, frames, scale, &svg);
  draw_breaks(analysis, scale, &svg);
  draw_ends(analysis, scale, &svg);
  draw_scale_bar(scale, &svg);
  if (analysis.map_is_enu) draw_north(scale, &svg);
  return std::move(svg).finish();
}

}  // namespace vergence::app::report
