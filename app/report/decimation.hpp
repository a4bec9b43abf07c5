#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace vergence::app::report {

struct Point {
  double x = 0, y = 0;
};
using Line = std::vector<Point>;

/// A curve cut into its unbroken pieces with at most four points a column: the first, the lowest,
/// the highest and the last of those that fall into it, in their order. So every extreme survives
/// and no line is drawn where there is no value.
///
/// A value that is no number ends a piece; so does breaks[i] != 0, before value i. Memory: the
/// result. Linear.
/// Precondition: x, y and breaks (unless empty) of one size; x ascends within a piece; x0 < x1;
/// columns > 0.
[[nodiscard]] std::vector<Line> decimate(std::span<const double> x, std::span<const double> y,
                                         std::span<const std::uint8_t> breaks, double x0, double x1,
                                         int columns);

/// Lines in the plane, cut like above, without the points nearer than `step` to the one kept
/// before. First and last stay. With more than `most` points left the step is doubled until they
/// fit.
[[nodiscard]] std::vector<Line> thin(std::span<const double> x, std::span<const double> y,
                                     std::span<const std::uint8_t> breaks, double step,
                                     std::size_t most);

}  // namespace vergence::app::report
