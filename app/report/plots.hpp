#pragma once
#include <span>

#include "app/report/analysis.hpp"

/// Plots of a session, each a complete <svg> with coordinates in units of its viewBox, kPlotWidth
/// wide, so that text stays readable on a phone. Decimation keeps extremes; missing values leave
/// gaps.
namespace vergence::app::report {

inline constexpr double kPlotWidth = 440, kPlotHeight = 190;

/// Curve over the time of the frames.
struct CurvePlot {
  std::string description;
  /// One value per frame.
  std::span<const double> y;
  const char* css = "curve s-ours";
  /// True if the y axis starts at 0.
  bool from_zero = false;
};
/// Empty if there is no value.
[[nodiscard]] std::string curve_plot(const CurvePlot& plot, const Analysis& analysis,
                                     std::span<const Frame> frames);

/// Estimate and reference from above, with equal scales, a scale bar and a north arrow if up is
/// north.
[[nodiscard]] std::string map_plot(const Analysis& analysis, std::span<const Frame> frames);

/// Lanes for every status and state that occurred, and one for events. All values within a pixel
/// column are visible.
[[nodiscard]] std::string bands_plot(const Session& session, const Analysis& analysis);

/// Number of a camera's calibration over the run, with a band of ± 2 sigma. Hollow red marks are
/// rejected calibrations, hollow grey ones measurements that did not replace the one in use. A
/// dashed line marks the first verification. `component`: 0–2 rotation vector in degrees; 3–5
/// translation in millimetres. Empty if no row has it.
[[nodiscard]] std::string calibration_plot(const Session& session, const Analysis& analysis,
                                           int camera, int component);

}  // namespace vergence::app::report
