#include <algorithm>
#include <cmath>

#include "app/report/frame.hpp"
#include "app/report/plots.hpp"
#include "app/report/svg.hpp"
#include "core/math/angle.hpp"

namespace vergence::app::report {
namespace {

constexpr double kMillimetres = 1e3;

struct Held {  // a value that held for a while
  double from = 0, to = 0, value = 0, two_sigma = kNone;
};

struct Mark {  // a value that was found and not taken
  double at = 0, value = 0, two_sigma = kNone;
};

struct CalibrationCurve {
  std::vector<Held> held;
  std::vector<Mark> rejected, measured;
  [[nodiscard]] bool empty() const { return held.empty() && rejected.empty() && measured.empty(); }
};

struct Component {
  double value = 0, sigma = kNone;
};

/// A number of a row in the unit it is shown in.
Component component_of(const CalibrationRow& c, int component) {
  const double unit = component < 3 ? kDegreesPerRadian : kMillimetres;
  const auto k = static_cast<std::size_t>(component);
  return {c.value[k] * unit, c.has_sigma ? c.sigma[k] * unit : kNone};
}

CalibrationCurve calibration_curve(const Session& s, const Analysis& a, int camera, int component) {
  CalibrationCurve curve;
  for (const CalibrationRow& c : s.calibrations) {
    if (c.camera != camera) continue;
    const Component number = component_of(c, component);
    const double since = s.frames.empty() ? 0
                                          : (static_cast<double>(c.stamp.ns()) -
                                             static_cast<double>(s.frames.front().stamp.ns())) *
                                                1e-9;
    const double at = std::clamp(since, 0.0, a.duration_s);
    if (c.accepted) {
      if (!curve.held.empty()) curve.held.back().to = at;
      curve.held.push_back({at, a.duration_s, number.value, 2 * number.sigma});
    } else if (!c.kept) {
      curve.rejected.push_back({at, number.value, kNone});
    } else if (std::isfinite(c.depth_sigma_percent)) {  // else the solve came to nothing
      curve.measured.push_back({at, number.value, 2 * number.sigma});
    }
  }
  return curve;
}

void fit_calibration(const CalibrationCurve& curve, PlotBox* box) {
  double low = 1e300, high = -1e300;
  const auto include = [&](double v) { low = std::min(low, v), high = std::max(high, v); };
  for (const Held& h : curve.held) {
    const double s = std::isfinite(h.two_sigma) ? h.two_sigma : 0;
    include(h.value - s), include(h.value + s);
  }
  for (const Mark& m : curve.rejected) include(m.value);
  for (const Mark& m : curve.measured) {
    const double s = std::isfinite(m.two_sigma) ? m.two_sigma : 0;
    include(m.value - s), include(m.value + s);
  }
  box->fit_y(low, high, false);
}

void draw_held(const CalibrationCurve& curve, const PlotBox& box, Svg* svg) {
  Line steps;
  for (const Held& h : curve.held) {
    if (h.two_sigma > 0)
      svg->rect("band", box.x(h.from), box.y(h.value + h.two_sigma), box.x(h.to) - box.x(h.from),
                box.y(h.value - h.two_sigma) - box.y(h.value + h.two_sigma));
    steps.push_back({box.x(h.from), box.y(h.value)});
    steps.push_back({box.x(h.to), box.y(h.value)});
  }
  if (!steps.empty()) svg->lines("curve s-ours", {steps});
  for (const Held& h : curve.held) svg->circle("f-ours", box.x(h.from), box.y(h.value), 2.6);
}

void draw_marks(const CalibrationCurve& curve, const PlotBox& box, Svg* svg) {
  for (const Mark& m : curve.measured) {
    const double x = box.x(m.at);
    if (m.two_sigma > 0)
      svg->line("whisker", x, box.y(m.value + m.two_sigma), x, box.y(m.value - m.two_sigma));
    svg->circle("seen", x, box.y(m.value), 2.8);
  }
  for (const Mark& m : curve.rejected) svg->circle("hollow", box.x(m.at), box.y(m.value), 3.2);
}

void draw_confirmation(double at_s, const PlotBox& box, Svg* svg) {
  const double x = box.x(at_s);
  svg->line("confirmed", x, box.top, x, box.bottom);
  const bool near_the_end = x > box.right - 60;
  svg->text("good", near_the_end ? Anchor::end : Anchor::start, x + (near_the_end ? -5 : 5),
            box.top + 11, "verified");
}

}  // namespace

std::string calibration_plot(const Session& session, const Analysis& analysis, int camera,
                             int component) {
  const CalibrationCurve curve = calibration_curve(session, analysis, camera, component);
  if (curve.empty()) return {};
  PlotBox box = time_box(analysis);
  box.left = 74;  // four decimals
  fit_calibration(curve, &box);
  Svg svg(kPlotWidth, kPlotHeight, "A number of the calibration over time with two sigmas");
  box.draw_x_axis(&svg, XAxis::time_s);
  box.draw_y_axis(&svg);
  if (analysis.confirmed_s) draw_confirmation(*analysis.confirmed_s, box, &svg);
  draw_held(curve, box, &svg);
  draw_marks(curve, box, &svg);
  return std::move(svg).finish();
}

}  // namespace vergence::app::report
