#include "app/report/plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "app/report/decimation.hpp"
#include "app/report/frame.hpp"
#include "app/report/svg.hpp"

namespace vergence::app::report {
namespace {

constexpr int kColumns = 740;  // of a curve, two a unit of the paper: sharp on a fine screen

/// An axis from the first to the last value, never empty.
void fit_x(PlotBox* box, double low, double high) {
  box->x0 = low;
  box->x1 = high > low ? high : low + 1;
}

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

}  // namespace

PlotBox time_box(const Analysis& a) {
  PlotBox box;
  fit_x(&box, 0, a.duration_s);
  return box;
}

Line PlotBox::line(const Line& data) const {
  Line placed;
  placed.reserve(data.size());
  for (const Point& p : data) placed.push_back({x(p.x), y(p.y)});
  return placed;
}

void PlotBox::fit_y(double low, double high, bool from_zero) {
  if (from_zero) low = std::min(0.0, low);
  const double least =
      std::max({std::abs(low), std::abs(high), 1e-6}) * 1e-6;  // what doubles can show apart
  const double air = std::max(0.06 * (high - low), least);
  y0 = from_zero && low == 0.0 ? 0.0 : low - air;
  y1 = high + air;
}

void PlotBox::draw_x_axis(Svg* svg, XAxis axis) const {
  constexpr int kMost = 6;
  const bool kilometres = axis == XAxis::distance_m && x1 - x0 >= 3000;
  const double unit = kilometres ? 1000.0 : 1.0;
  const auto ticks =
      axis == XAxis::time_s ? time_ticks(x0, x1, kMost) : nice_ticks(x0 / unit, x1 / unit, kMost);
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 1;
  for (const double t : ticks) {
    const double at = x(t * unit);
    svg->line("tick", at, top, at, bottom);
    const std::string label = axis == XAxis::time_s ? time_label(t, step) : tick_label(t, step);
    // The outer ones keep clear of the other axis's numbers and of the edge.
    const bool first = at<left + 14, last = at> right - 14;
    svg->text("",
              first  ? Anchor::start
              : last ? Anchor::end
                     : Anchor::middle,
              first ? left - 3 : std::min(at, right + 10), bottom + 16, label);
  }
  svg->line("axis", left, bottom, right, bottom);
  const char* words = kilometres                  ? "driven, km"
                      : axis == XAxis::distance_m ? "driven, m"
                      : x1 - x0 > 60              ? "time, min:s"
                                                  : "time, s";
  svg->text("", Anchor::middle, (left + right) / 2, bottom + 32, words);
}

void PlotBox::draw_y_axis(Svg* svg) const {
  const auto ticks = nice_ticks(y0, y1, 5);
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : y1 - y0;
  for (const double t : ticks) {
    svg->line(t == 0.0 && y0 < 0 ? "axis" : "tick", left, y(t), right, y(t));
    svg->text("", Anchor::end, left - 6, y(t) + 4.5, tick_label(t, step));
  }
  svg->line("axis", left, top, left, bottom);
}

std::string curve_plot(const CurvePlot& plot, const Analysis& analysis,
                       std::span<const Frame> frames) {
  PlotBox box;
  double low = 0, high = 0;
  bool any = false;
  for (const double v : plot.y) {
    if (!std::isfinite(v)) continue;
    low = any ? std::min(low, v) : v;
    high = any ? std::max(high, v) : v;
    any = true;
  }
  if (!any) return {};
  fit_x(&box, plot.x.front(), plot.x.back());
  box.fit_y(low, high, plot.from_zero);
  Svg svg(kPlotWidth, kPlotHeight, plot.description);
  if (plot.axis == XAxis::time_s) draw_holes(box, analysis.time_s, frames, &svg);
  box.draw_x_axis(&svg, plot.axis);
  box.draw_y_axis(&svg);
  svg.lines(plot.css,
            on_paper(box, decimate(plot.x, plot.y, plot.breaks, box.x0, box.x1, kColumns)));
  return std::move(svg).finish();
}

// ---- bands

namespace {

struct Lane {
  std::string name;
  const char* css;
  std::vector<std::uint8_t> columns;  // 1: it occurred there
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

std::vector<Lane> lanes_of(const Session& s, const Analysis& a, const PlotBox& box) {
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
    if (f.status) mark(&lanes[static_cast<std::size_t>(*f.status)], box, a, i);
    if (!f.state || f.state == State::lost)
      continue;  // that state and that status are the same frames
    auto& lane = states[static_cast<std::size_t>(*f.state)];
    if (!lane) {
      std::string name(to_string(*f.state));
      std::replace(name.begin(), name.end(), '_', ' ');
      lane = empty(name, kStateCss[static_cast<std::size_t>(*f.state)]);
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

}  // namespace

std::string bands_picture(const Session& session, const Analysis& analysis) {
  if (analysis.read == analysis.unknown) return {};
  PlotBox box = time_box(analysis);
  box.left = kBandLeft;
  box.top = 2;
  const std::vector<Lane> lanes = lanes_of(session, analysis, box);
  constexpr std::size_t kStatuses = 3;
  constexpr double kApart = 8;  // between statuses, states and events
  const double events_top = box.top + kLaneHeight * static_cast<double>(lanes.size()) + 2 * kApart;
  box.bottom = events_top + kLaneHeight;
  Svg svg(kPlotWidth, box.bottom + 36,
          "Status of the frames, state of the system and events over time");
  for (std::size_t i = 0; i < lanes.size(); ++i)
    draw_lane(lanes[i], box,
              box.top + kLaneHeight * static_cast<double>(i) + (i >= kStatuses ? kApart : 0), &svg);
  draw_events(session, box, events_top, &svg);
  box.draw_x_axis(&svg, XAxis::time_s);
  return std::move(svg).finish();
}

// ---- timing

namespace {

std::vector<double> times_of(const Session& s) {
  std::vector<double> times;
  for (const Frame& f : s.frames)
    if (f.estimate_ms >= 0) times.push_back(f.estimate_ms);
  std::sort(times.begin(), times.end());
  return times;
}

}  // namespace

TimingPicture timing_picture(const Session& session, const Analysis& analysis) {
  TimingPicture picture;
  const std::vector<double> times = times_of(session);
  picture.frames = times.size();
  if (times.empty()) return picture;
  const double budget = analysis.interval_s * 1e3;
  picture.over_budget =
      budget > 0 ? static_cast<std::size_t>(times.end() -
                                            std::upper_bound(times.begin(), times.end(), budget))
                 : 0;
  // The axis reaches to the budget and to nearly all frames; what is slower than its end stands in
  // the last bar.
  const double most = times[std::min(times.size() - 1, times.size() * 999 / 1000)];
  constexpr int kBars = 60;
  PlotBox box;
  box.x0 = 0;
  box.x1 = std::max({most, budget > 20 * most ? 0.0 : budget, 1e-3}) * 1.08;
  std::array<std::size_t, kBars> bars{};
  for (const double t : times)
    ++bars[static_cast<std::size_t>(std::min(t / box.x1 * kBars, kBars - 1.0))];
  box.fit_y(0, static_cast<double>(*std::max_element(bars.begin(), bars.end())), true);
  Svg svg(kPlotWidth, kPlotHeight, "How many frames took how many milliseconds");
  box.draw_y_axis(&svg);
  const auto ticks = nice_ticks(box.x0, box.x1, 6);
  for (const double t : ticks)
    svg.text("", t == 0.0 ? Anchor::start : Anchor::middle, box.x(t) - (t == 0.0 ? 3 : 0),
             box.bottom + 16, tick_label(t, ticks.size() > 1 ? ticks[1] - ticks[0] : 1));
  svg.text("", Anchor::middle, (box.left + box.right) / 2, box.bottom + 32,
           "from the images to the pose, ms");
  const double width = (box.right - box.left) / kBars;
  for (int i = 0; i < kBars; ++i) {
    const auto n = static_cast<double>(bars[static_cast<std::size_t>(i)]);
    if (n <= 0) continue;
    const double height =
        std::max(1.0, box.bottom - box.y(n));  // a single frame among thousands still shows
    svg.rect("f-ours", box.left + width * i + 0.5, box.bottom - height, width - 1, height);
  }
  svg.line("axis", box.left, box.bottom, box.right, box.bottom);
  if (budget > 0 && budget <= box.x1)
    svg.line("budget", box.x(budget), box.top, box.x(budget), box.bottom);
  picture.svg = std::move(svg).finish();
  return picture;
}

}  // namespace vergence::app::report
