#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The few shapes the page is drawn with. Everything that goes in is numbers of ours, class names
/// of ours, or escaped text.
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

/// Text from outside for HTML and SVG, in elements and in quoted attributes: markup escaped,
/// control characters and broken UTF-8 replaced, cut with an ellipsis after `most` bytes.
[[nodiscard]] std::string escape(std::string_view text, std::size_t most = 300);

/// A coordinate: one decimal, no negative zero. What is not finite becomes 0.
[[nodiscard]] std::string coordinate(double value);

/// Places on an axis: multiples of 1, 2 or 5 times a power of ten, at most `most` of them, all
/// within [low, high].
[[nodiscard]] std::vector<double> nice_ticks(double low, double high, int most);
/// Ticks in seconds: steps of whole minutes and hours beyond a minute.
[[nodiscard]] std::vector<double> time_ticks(double low, double high, int most);
/// A tick's number with as many decimals as its distance to the next needs.
[[nodiscard]] std::string tick_label(double value, double step);
/// Seconds as `8`, `1:05`, `2:03:00`; below a minute with the decimals that `step` needs.
[[nodiscard]] std::string time_label(double seconds, double step);
/// Duration with its unit: `8 s`, `1:05 min`, `2:03:00 h`, `139 days`.
[[nodiscard]] std::string duration_text(double seconds, double step);

enum class Anchor : std::uint8_t { start, middle, end };

/// An <svg> that grows; its units are those of the viewBox.
class Svg {
 public:
  /// `description` is for screen readers.
  Svg(double width, double height, std::string_view description);

  void line(const char* css, double x1, double y1, double x2, double y2);
  void rect(const char* css, double x, double y, double width, double height);
  void circle(const char* css, double x, double y, double radius);
  /// Every line of the set in one path. A line of one point shows as a dot (CSS has round caps).
  void lines(const char* css, const std::vector<Line>& lines);
  void polygon(const char* css, const Line& corners);
  void text(const char* css, Anchor anchor, double x, double y, std::string_view words);
  /// The whole element; nothing may follow.
  [[nodiscard]] std::string finish() &&;

 private:
  std::string out_;
};

}  // namespace vergence::app::report
