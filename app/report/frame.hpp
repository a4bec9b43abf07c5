#pragma once
#include "app/report/plots.hpp"
#include "app/report/svg.hpp"

namespace vergence::app::report {

/// The box of a plot: where data lies on the paper, and its axes.
struct PlotBox {
  double left = 58, right = kPlotWidth - 12, top = 8, bottom = kPlotHeight - 36;  // on the paper
  double x0 = 0, x1 = 1, y0 = 0, y1 = 1;  // of the data, x0 < x1, y0 < y1

  [[nodiscard]] double x(double v) const noexcept {
    return left + (v - x0) / (x1 - x0) * (right - left);
  }
  [[nodiscard]] double y(double v) const noexcept {
    return bottom - (v - y0) / (y1 - y0) * (bottom - top);
  }
  [[nodiscard]] Line line(const Line& data) const;
  void draw_x_axis(Svg* svg, XAxis axis) const;
  void draw_y_axis(Svg* svg) const;
  /// Sets y0 and y1 around values with some air; equal values get a box, too. from_zero: y0 is 0.
  void fit_y(double low, double high, bool from_zero);
};

/// From the first frame to the last along x.
[[nodiscard]] PlotBox time_box(const Analysis& analysis);

}  // namespace vergence::app::report
