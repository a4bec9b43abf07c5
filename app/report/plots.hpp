#pragma once
#include <span>
#include <string>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"

/// Pictures of a session, each a whole <svg>; every coordinate is in units of its viewBox,
/// kPlotWidth wide, so that letters stay readable on a phone. Curves are decimated so that extremes
/// stay; where there is no value nothing is drawn.
namespace vergence::app::report {

inline constexpr double kPlotWidth = 440, kPlotHeight = 190;

/// A curve over the time of the frames.
struct CurvePlot {
  std::string description;
  std::span<const double> y;  // a value a frame
  const char* css = "curve s-ours";
  bool from_zero = false;  // the y axis begins at 0
};
/// Empty when there is no value at all.
[[nodiscard]] std::string curve_plot(const CurvePlot& plot, const Analysis& analysis,
                                     std::span<const Frame> frames);

/// Ours and the reference from above, equal scale, scale bar, north arrow where up is north.
[[nodiscard]] std::string map_plot(const Analysis& analysis, std::span<const Frame> frames);

/// A lane for every status and state that occurred, and one for events. In a pixel column that
/// holds several, each shows.
[[nodiscard]] std::string bands_plot(const Session& session, const Analysis& analysis);

/// One number of a camera's calibration as it held over the drive, with a band of ± 2 sigma; hollow
/// red marks are rejected ones, hollow grey ones what the drive measured beside one that was kept.
/// A dashed line: the drive confirmed it there first. `component`: 0–2 rotation vector, shown in
/// degrees; 3–5 translation, in millimetres. Empty when no row has it.
[[nodiscard]] std::string calibration_plot(const Session& session, const Analysis& analysis,
                                           int camera, int component);

}  // namespace vergence::app::report
