#include "app/report/svg.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "app/runtime/terminal_text.hpp"

namespace vergence::app::report {

namespace {

/// Indices of an unbroken piece of a curve.
struct Piece {
  std::size_t begin = 0, end = 0;
};

std::vector<Piece> pieces_of(std::span<const double> x, std::span<const double> y,
                             std::span<const std::uint8_t> breaks) {
  std::vector<Piece> pieces;
  bool open = false;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const bool there = std::isfinite(y[i]) && std::isfinite(x[i]);
    if (there && (!open || (!breaks.empty() && breaks[i] != 0))) pieces.push_back({i, i});
    if (there) pieces.back().end = i + 1;
    open = there;
  }
  return pieces;
}

std::vector<Line> thinned(std::span<const double> x, std::span<const double> y,
                          const std::vector<Piece>& pieces, double step) {
  std::vector<Line> lines;
  for (const Piece& piece : pieces) {
    Line line{{x[piece.begin], y[piece.begin]}};
    for (std::size_t i = piece.begin + 1; i < piece.end; ++i)
      if (i + 1 == piece.end || std::hypot(x[i] - line.back().x, y[i] - line.back().y) >= step)
        line.push_back({x[i], y[i]});
    lines.push_back(std::move(line));
  }
  return lines;
}

// The limit is far outside every drawing.
constexpr double kLargestCoordinate = 1e6;

std::vector<double> multiples(double low, double high, double step, int most) {
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9);
  for (int i = 0; i <= most + 1; ++i) {
    const double tick = (first + i) * step;
    if (tick > high + 1e-9 * step) break;
    ticks.push_back(tick);
  }
  return ticks;
}

double nice_step(double span, int most) {
  const double raw = span / std::max(1, most);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0, 10.0})
    if (m * power >= raw * (1 - 1e-9)) return m * power;
  return 10 * power;
}

}  // namespace

std::vector<Line> decimate(std::span<const double> x, std::span<const double> y,
                           std::span<const std::uint8_t> breaks, double x0, double x1,
                           int columns) {
  assert(x.size() == y.size() && (breaks.empty() || breaks.size() == y.size()) && x0 < x1 &&
         columns > 0);
  const double per_column = columns / (x1 - x0);
  const auto column = [&](double at) {
    return std::floor(std::clamp((at - x0) * per_column, -1.0, columns + 1.0));
  };
  std::vector<Line> lines;
  for (const Piece& piece : pieces_of(x, y, breaks)) {
    Line line;
    for (std::size_t i = piece.begin; i < piece.end;) {
      const std::size_t begin = i;
      const double here = column(x[begin]);
      while (i < piece.end && column(x[i]) == here) ++i;
      // The values [begin, i) share a column.
      const auto values = y.subspan(begin, i - begin);
      const auto [low, high] = std::ranges::minmax_element(values);
      std::array kept{begin, begin + static_cast<std::size_t>(std::min(low, high) - values.begin()),
                      begin + static_cast<std::size_t>(std::max(low, high) - values.begin()),
                      i - 1};
      const auto last = std::unique(kept.begin(), kept.end());
      for (auto k = kept.begin(); k != last; ++k) line.push_back({x[*k], y[*k]});
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<Line> thin(std::span<const double> x, std::span<const double> y,
                       std::span<const std::uint8_t> breaks, double step, std::size_t most) {
  assert(x.size() == y.size() && (breaks.empty() || breaks.size() == y.size()) && step > 0);
  // The limit is 10¹² times the first step, which is wider than any map.
  constexpr int kDoublings = 40;
  const std::vector<Piece> pieces = pieces_of(x, y, breaks);
  std::vector<Line> lines = thinned(x, y, pieces, step);
  const auto points = [&] {
    std::size_t n = 0;
    for (const Line& line : lines) n += line.size();
    return n;
  };
  for (int i = 0; i < kDoublings && points() > most; ++i) lines = thinned(x, y, pieces, step *= 2);
  return lines;
}

std::string escape(std::string_view text, std::size_t most) {
  constexpr std::string_view kSpecial = "&<>\"'";
  constexpr std::array kEntities{"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t n = utf8_length(text.substr(i)), bytes = std::max<std::size_t>(n, 1);
    if (i + bytes > most) return out + "…";
    const auto c = static_cast<unsigned char>(text[i]);
    if (n == 0)
      out += "\xEF\xBF\xBD";
    else if (const std::size_t special = kSpecial.find(text[i]); special < kEntities.size())
      out += kEntities[special];
    else
      out += c < 0x20 || c == 0x7f ? " " : text.substr(i, n);
    i += bytes;
  }
  return out;
}

std::string coordinate(double value) {
  if (!std::isfinite(value)) return "0";
  // Adding 0.0 turns a negative zero into a positive one.
  const double v =
      std::round(std::clamp(value, -kLargestCoordinate, kLargestCoordinate) * 10) / 10 + 0.0;
  return v == std::floor(v) ? fmt::format("{:.0f}", v) : fmt::format("{:.1f}", v);
}

std::vector<double> nice_ticks(double low, double high, int most) {
  if (!(high > low)) return {low};
  return multiples(low, high, nice_step(high - low, most), most);
}

std::vector<double> time_ticks(double low, double high, int most) {
  constexpr std::array kSteps{1.0,    2.0,    5.0,     10.0,    15.0,    30.0,
                              60.0,   120.0,  300.0,   600.0,   900.0,   1800.0,
                              3600.0, 7200.0, 14400.0, 21600.0, 43200.0, 86400.0};
  const double span = high - low;
  const auto step = std::ranges::find_if(kSteps, [=](double s) { return span / s <= most; });
  if (span / kSteps.front() < most || step == kSteps.end()) return nice_ticks(low, high, most);
  return multiples(low, high, *step, most);
}

std::string tick_label(double value, double step) {
  const double v = value + 0.0;
  if (std::abs(v) >= 1e6 || (step < 1e-6 && step > 0)) return fmt::format("{:.3g}", v);
  const int decimals =
      step > 0 ? std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6) : 2;
  const std::string text = fmt::format("{:.{}f}", std::abs(v) < step * 1e-6 ? 0.0 : v, decimals);
  // The minus sign is as wide as a digit.
  return v < 0 && text.front() == '-' ? "−" + text.substr(1) : text;
}

std::string time_label(double seconds, double step) {
  if (std::abs(seconds) < 60 && step < 60) return tick_label(seconds, step);
  if (seconds > 1e7) return fmt::format("{:.3g}", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(std::abs(seconds)));
  const char* sign = seconds < 0 ? "−" : "";
  if (whole < 3600) return fmt::format("{}{}:{:02}", sign, whole / 60, whole % 60);
  return fmt::format("{}{}:{:02}:{:02}", sign, whole / 3600, whole / 60 % 60, whole % 60);
}

std::string duration_text(double seconds, double step) {
  // Durations in s.
  constexpr double kHour = 3600, kDay = 86400, kMax = 1e7;
  if (seconds > kMax) return fmt::format("{:.0f} days", seconds / kDay);
  const char* unit = seconds < 60 ? " s" : std::round(seconds) < kHour ? " min" : " h";
  return time_label(seconds, step) + unit;
}

Svg::Svg(double width, double height, std::string_view description) {
  out_ = fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="{}">)", coordinate(width),
                     coordinate(height), escape(description));
}

void Svg::line(const char* css, double x1, double y1, double x2, double y2) {
  fmt::format_to(std::back_inserter(out_), R"(<line class="{}" x1="{}" y1="{}" x2="{}" y2="{}"/>)",
                 css, coordinate(x1), coordinate(y1), coordinate(x2), coordinate(y2));
}

void Svg::rect(const char* css, double x, double y, double width, double height) {
  fmt::format_to(std::back_inserter(out_),
                 R"(<rect class="{}" x="{}" y="{}" width="{}" height="{}"/>)", css, coordinate(x),
                 coordinate(y), coordinate(std::max(0.0, width)),
                 coordinate(std::max(0.0, height)));
}

void Svg::circle(const char* css, double x, double y, double radius) {
  fmt::format_to(std::back_inserter(out_), R"(<circle class="{}" cx="{}" cy="{}" r="{}"/>)", css,
                 coordinate(x), coordinate(y), coordinate(radius));
}

void Svg::lines(const char* css, const std::vector<Line>& lines) {
  if (lines.empty()) return;
  out_ += fmt::format(R"(<path class="{}" d=")", css);
  for (const Line& line : lines) {
    char command = 'M';
    for (const Point& p : line) {
      (out_ += command) += coordinate(p.x);
      (out_ += ' ') += coordinate(p.y);
      command = command == 'M' ? 'L' : ' ';
    }
    if (line.size() == 1) out_ += "h0";
  }
  out_ += R"("/>)";
}

void Svg::polygon(const char* css, const Line& corners) {
  out_ += fmt::format(R"(<polygon class="{}" points=")", css);
  for (const Point& p : corners) ((out_ += coordinate(p.x)) += ',') += coordinate(p.y) + " ";
  out_ += R"("/>)";
}

void Svg::text(const char* css, Anchor anchor, double x, double y, std::string_view words) {
  const char* name = anchor == Anchor::start    ? "start"
                     : anchor == Anchor::middle ? "middle"
                                                : "end";
  fmt::format_to(std::back_inserter(out_),
                 R"(<text class="{}" text-anchor="{}" x="{}" y="{}">{}</text>)", css, name,
                 coordinate(x), coordinate(y), escape(words));
}

std::string Svg::finish() && {
  out_ += "</svg>\n";
  return std::move(out_);
}

}  // namespace vergence::app::report
