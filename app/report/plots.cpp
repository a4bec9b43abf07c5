#include "app/report/plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <Eigen/Geometry>

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

constexpr double kLaneHeight = 21, kBandLeft = 148;

/// Draws the runs of frames for which `shown` is true as rectangles from each run's first frame to
/// the frame after it; runs in one pixel column become one.
template <class Shown>
void draw_runs(const char* css, const PlotBox& box, const Analysis& a, double top, double height,
               const Shown& shown, Svg* svg) {
  double drawn_to = -1;
  const std::size_t n = a.time_s.size();
  for (std::size_t i = 0; i < n;) {
    if (!shown(i)) {
      ++i;
      continue;
    }
    const std::size_t begin = i++;
    while (i < n && shown(i) && a.breaks[i] == 0) ++i;
    const double end = i < n && a.breaks[i] == 0 ? a.time_s[i] : a.time_s[i - 1] + a.interval_s;
    const double from = std::max(box.x(a.time_s[begin]), drawn_to),
                 to = std::min(std::max(box.x(end), from + 1), box.right);
    if (to <= drawn_to + 0.5) continue;
    svg->rect(css, from, top, to - from, height);
    drawn_to = to;
  }
}

void draw_track(std::string name, const PlotBox& box, double top, Svg* svg) {
  std::ranges::replace(name, '_', ' ');
  svg->text("strong", Anchor::end, box.left - 8, top + 13.5, name);
  svg->rect("track", box.left, top + 3, box.right - box.left, kLaneHeight - 7);
}

/// A row of the bands: the frames of one status or state.
struct Lane {
  std::string_view name;
  const char* css;
  std::function<bool(std::size_t)> shown;
};

/// All statuses, and the states that occurred; the state and the status `lost` are the same frames.
std::vector<Lane> make_lanes(std::span<const Frame> frames) {
  constexpr std::array<const char*, 3> kStatusCss{"f-good", "f-care", "f-bad"};
  constexpr std::array<const char*, 5> kStateCss{"f-care", "f-third", "f-theirs", "f-ours",
                                                 "f-fourth"};
  std::vector<Lane> lanes;
  for (std::size_t k = 0; k < kStatusCss.size(); ++k)
    lanes.push_back({to_string(static_cast<PoseStatus>(k)), kStatusCss[k], [=](std::size_t i) {
                       return frames[i].status == static_cast<PoseStatus>(k);
                     }});
  for (std::size_t k = 0; k < kStateCss.size(); ++k)
    if (const auto state = static_cast<State>(k);
        std::ranges::find(frames, state, &Frame::state) != frames.end())
      lanes.push_back({to_string(state), kStateCss[k],
                       [=](std::size_t i) { return frames[i].state == state; }});
  return lanes;
}

/// Value of a calibration parameter, in use from `from` to `to`.
struct CalibrationValue {
  enum class Kind : std::uint8_t { used, measured, rejected } kind = Kind::used;
  double from = 0, to = 0, value = 0;
  // 0 if unknown.
  double two_sigma = 0;
};

std::vector<CalibrationValue> calibration_values(const Session& s, const Analysis& a, int camera,
                                                 std::size_t component) {
  using enum CalibrationValue::Kind;
  constexpr double kMillimetres = 1e3;
  const double unit = component < 3 ? kDegreesPerRadian : kMillimetres;
  std::vector<CalibrationValue> values;
  CalibrationValue* in_use = nullptr;
  values.reserve(s.calibrations.size());
  for (const CalibrationRow& c : s.calibrations) {
    // A measurement without a finite sigma is a failed solve.
    if (c.camera != camera || (c.kept && !std::isfinite(c.depth_sigma_percent))) continue;
    const double since = s.frames.empty() || c.stamp < s.frames.front().stamp
                             ? 0
                             : seconds_between(s.frames.front().stamp, c.stamp);
    const double at = std::min(since, a.duration_s);
    values.push_back({c.accepted ? used
                      : c.kept   ? measured
                                 : rejected,
                      at, a.duration_s, c.value[component] * unit,
                      c.has_sigma ? 2 * c.sigma[component] * unit : 0});
    if (!c.accepted) continue;
    if (in_use != nullptr) in_use->to = at;
    in_use = &values.back();
  }
  return values;
}

void draw_calibration(const std::vector<CalibrationValue>& values, const PlotBox& box, Svg* svg) {
  using enum CalibrationValue::Kind;
  Line steps;
  for (const CalibrationValue& v : values) {
    if (v.kind != used) continue;
    const double high = box.y(v.value + v.two_sigma), low = box.y(v.value - v.two_sigma);
    if (v.two_sigma > 0)
      svg->rect("band", box.x(v.from), high, box.x(v.to) - box.x(v.from), low - high);
    steps.push_back({box.x(v.from), box.y(v.value)});
    steps.push_back({box.x(v.to), box.y(v.value)});
  }
  if (!steps.empty()) svg->lines("curve s-ours", {steps});
  for (const CalibrationValue& v : values)
    svg->circle(v.kind == used       ? "f-ours"
                : v.kind == measured ? "seen"
                                     : "hollow",
                box.x(v.from), box.y(v.value), 2.8);
}

// Sizes in the drawing. kFoot is the room for the scale bar.
constexpr double kMargin = 16, kFoot = 38, kMin = 190, kMax = 420;
// Distance in the drawing that is smaller than the line width.
constexpr double kThin = 0.4;
constexpr std::size_t kMaxPoints = 20'000;

/// From metres to the paper, one scale for both axes; up is up.
struct MapScale {
  double per_metre = 1, x_middle = 0, y_middle = 0, height = kMin;
  [[nodiscard]] double x(double v) const { return kPlotWidth / 2 + (v - x_middle) * per_metre; }
  [[nodiscard]] double y(double v) const {
    return kMargin + (height - kMargin - kFoot) / 2 - (v - y_middle) * per_metre;
  }
};

void draw_path(const char* css, std::vector<double> x, std::vector<double> y,
               const std::vector<std::uint8_t>& breaks, const MapScale& s, Svg* svg) {
  for (double& v : x) v = s.x(v);
  for (double& v : y) v = s.y(v);
  svg->lines(css, thin(x, y, breaks, kThin, kMaxPoints));
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

/// From the first frame to the last along x.
PlotBox time_box(const Analysis& a) {
  PlotBox box;
  // The range is never empty.
  box.x1 = a.duration_s > 0 ? a.duration_s : 1;
  return box;
}

}  // namespace

std::string curve_plot(const CurvePlot& plot, const Analysis& analysis,
                       std::span<const Frame> frames) {
  PlotBox box = time_box(analysis);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double v : plot.y)
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  if (low > high) return {};
  box.fit_y(low, high, plot.from_zero);
  Svg svg(kPlotWidth, kPlotHeight, plot.description);
  draw_runs(
      "hole", box, analysis, box.top, box.bottom - box.top,
      [&](std::size_t i) { return !frames[i].posed; }, &svg);
  box.draw_time_axis(&svg);
  box.draw_y_axis(&svg);
  std::vector<Line> lines =
      decimate(analysis.time_s, plot.y, analysis.breaks, box.x0, box.x1, kColumns);
  for (Line& line : lines)
    for (Point& p : line) p = {box.x(p.x), box.y(p.y)};
  svg.lines(plot.css, lines);
  return std::move(svg).finish();
}

std::string bands_plot(const Session& session, const Analysis& analysis) {
  if (analysis.read == 0) return {};
  PlotBox box = time_box(analysis);
  box.left = kBandLeft;
  box.top = 2;
  const std::vector<Lane> lanes = make_lanes(session.frames);
  constexpr std::size_t kStatuses = 3;
  // Distance between statuses, states and events.
  constexpr double kApart = 8;
  const double events_top = box.top + kLaneHeight * static_cast<double>(lanes.size()) + 2 * kApart;
  box.bottom = events_top + kLaneHeight;
  Svg svg(kPlotWidth, box.bottom + 36,
          "Status of the frames, state of the estimator and events over time");
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const double top =
        box.top + kLaneHeight * static_cast<double>(i) + (i >= kStatuses ? kApart : 0);
    draw_track(std::string(lanes[i].name), box, top, &svg);
    draw_runs(lanes[i].css, box, analysis, top + 3, kLaneHeight - 7, lanes[i].shown, &svg);
  }
  const auto& frames = session.frames;
  draw_track("events", box, events_top, &svg);
  double last = -1;
  for (const Event& e : session.events) {
    if (frames.empty() || e.stamp < frames.front().stamp || e.stamp > frames.back().stamp) continue;
    const double at = box.x(seconds_between(frames.front().stamp, e.stamp));
    if (std::abs(at - last) < 1) continue;
    svg.rect("f-ink", std::clamp(at - 1, box.left, box.right - 2), events_top + 3, 2,
             kLaneHeight - 7);
    last = at;
  }
  box.draw_time_axis(&svg);
  return std::move(svg).finish();
}

std::string calibration_plot(const Session& session, const Analysis& analysis, int camera,
                             int component) {
  const std::vector<CalibrationValue> values =
      calibration_values(session, analysis, camera, static_cast<std::size_t>(component));
  if (values.empty()) return {};
  PlotBox box = time_box(analysis);
  // The left margin has room for four decimals.
  box.left = 74;
  double low = values.front().value, high = low;
  for (const CalibrationValue& v : values) {
    low = std::min(low, v.value - v.two_sigma);
    high = std::max(high, v.value + v.two_sigma);
  }
  box.fit_y(low, high, false);
  Svg svg(kPlotWidth, kPlotHeight, "A calibration parameter over time with its 2 sigma band");
  box.draw_time_axis(&svg);
  box.draw_y_axis(&svg);
  if (analysis.verified_s) {
    const double x = box.x(*analysis.verified_s);
    const bool near_the_end = x > box.right - 60;
    svg.line("confirmed", x, box.top, x, box.bottom);
    svg.text("good", near_the_end ? Anchor::end : Anchor::start, x + (near_the_end ? -5 : 5),
             box.top + 11, "verified");
  }
  draw_calibration(values, box, &svg);
  return std::move(svg).finish();
}

std::string map_plot(const Analysis& analysis, std::span<const Frame> frames) {
  Eigen::AlignedBox2d bounds;
  const auto include = [&](double x, double y) {
    if (std::isfinite(x)) bounds.extend(Eigen::Vector2d(x, y));
  };
  for (std::size_t i = 0; i < analysis.estimate_x.size(); ++i) {
    include(analysis.estimate_x[i], analysis.estimate_y[i]);
    include(analysis.reference_x[i], analysis.reference_y[i]);
  }
  if (bounds.isEmpty()) return {};
  // Minimum extent in m, so that the noise of a vehicle at rest is not enlarged.
  constexpr double kSmallest = 1;
  const double width = std::max(bounds.sizes().x(), kSmallest),
               depth = std::max(bounds.sizes().y(), kSmallest);
  MapScale scale{
      .per_metre = std::min((kPlotWidth - 2 * kMargin) / width, (kMax - kMargin - kFoot) / depth)};
  scale.height = std::clamp(depth * scale.per_metre + kMargin + kFoot, kMin, kMax);
  scale.x_middle = bounds.center().x(), scale.y_middle = bounds.center().y();
  Svg svg(kPlotWidth, scale.height, "Trajectory seen from above");
  draw_path("curve map-theirs s-theirs", analysis.reference_x, analysis.reference_y,
            analysis.breaks, scale, &svg);
  draw_path("curve map-ours s-ours", analysis.estimate_x, analysis.estimate_y, analysis.map_breaks,
            scale, &svg);
  // Degraded stretches lie over the path in their own colour.
  std::vector<double> degraded = analysis.estimate_x;
  for (std::size_t i = 0; i < degraded.size(); ++i)
    if (frames[i].status != PoseStatus::degraded) degraded[i] = kNone;
  draw_path("curve map-care s-care", degraded, analysis.estimate_y, analysis.map_breaks, scale,
            &svg);
  draw_ends(analysis, scale, &svg);
  const auto ticks = nice_ticks(0, 150 / scale.per_metre, 2);
  const double metres = ticks.size() > 1 ? ticks[1] : 1;
  const double foot = scale.height - 14, end = kMargin + metres * scale.per_metre;
  svg.lines("curve s-ink", {{{kMargin, foot - 5}, {kMargin, foot}, {end, foot}, {end, foot - 5}}});
  svg.text("strong", Anchor::start, end + 8, foot + 1,
           metres >= 1000 ? fmt::format("{:g} km", metres / 1000) : fmt::format("{:g} m", metres));
  if (analysis.map_is_enu) {
    const double x = kPlotWidth - kMargin - 8, y = scale.height - 12;
    svg.polygon("f-ink", {{x, y - 22}, {x + 6, y}, {x, y - 5}, {x - 6, y}});
    svg.text("strong", Anchor::end, x - 12, y - 2, "north");
  }
  return std::move(svg).finish();
}

}  // namespace vergence::app::report
