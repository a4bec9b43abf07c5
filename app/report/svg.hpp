#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// SVG elements of the page. All input is numbers and class names of this program, or escaped text.
namespace vergence::app::report {

struct Point {
  double x = 0, y = 0;
};
using Line = std::vector<Point>;

/// Splits a curve into unbroken pieces with at most four points per column: the first, minimum,
/// maximum and last, in order. So extremes are kept and gaps are not bridged.
///
/// A non-finite value ends a piece; so does breaks[i] != 0 before value i. Linear time.
/// Preconditions: x, y and breaks (unless empty) of equal size; x increases within a piece; x0 <
/// x1; columns > 0.
[[nodiscard]] std::vector<Line> decimate(std::span<const double> x, std::span<const double> y,
                                         std::span<const std::uint8_t> breaks, double x0, double x1,
                                         int columns);

/// Splits lines in the plane likewise, and drops points closer than `step` to the last kept one,
/// except the ends. While more than `most` points remain, the step is doubled.
[[nodiscard]] std::vector<Line> thin(std::span<const double> x, std::span<const double> y,
                                     std::span<const std::uint8_t> breaks, double step,
                                     std::size_t most);

/// Escapes external text for HTML and SVG elements and quoted attributes: replaces markup, control
/// characters and invalid UTF-8, and cuts with an ellipsis after `most` bytes.
[[nodiscard]] std::string escape(std::string_view text, std::size_t most = 300);

/// Coordinate with one decimal and no negative zero. Non-finite values become 0.
[[nodiscard]] std::string coordinate(double value);

/// Axis ticks: multiples of 1, 2 or 5 times a power of ten within [low, high], at most `most`.
[[nodiscard]] std::vector<double> nice_ticks(double low, double high, int most);
/// Ticks in seconds; beyond a minute in steps of whole minutes and hours.
[[nodiscard]] std::vector<double> time_ticks(double low, double high, int most);
/// Number of a tick with as many decimals as the step needs.
[[nodiscard]] std::string tick_label(double value, double step);
/// Seconds as `8`, `1:05`, `2:03:00`; below a minute with as many decimals as `step` needs.
[[nodiscard]] std::string time_label(double seconds, double step);
/// Duration with its unit: `8 s`, `1:05 min`, `2:03:00 h`, `139 days`.
[[nodiscard]] std::string duration_text(double seconds, double step);

enum class Anchor : std::uint8_t { start, middle, end };

/// Growing <svg> element in units of its viewBox.
class Svg {
 public:
  /// `description` is for screen readers.
  Svg(double width, double height, std::string_view description);

  void line(const char* css, double x1, double y1, double x2, double y2);
  void rect(const char* css, double x, double y, double width, double height);
  void circle(const char* css, double x, double y, double radius);
  /// Draws all lines in one path. A line of one point is a dot (CSS has round caps).
  void lines(const char* css, const std::vector<Line>& lines);
  void polygon(const char* css, const Line& corners);
  void text(const char* css, Anchor anchor, double x, double y, std::string_view words);
  /// Returns the complete element; must be the last call.
  [[nodiscard]] std::string finish() &&;

 private:
  std::string out_;
};

}  // namespace vergence::app::report
