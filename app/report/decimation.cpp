#include "app/report/decimation.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace vergence::app::report {
namespace {

struct Piece {
  std::size_t begin = 0, end = 0;
};

std::vector<Piece> pieces_of(std::span<const double> x, std::span<const double> y,
                             std::span<const std::uint8_t> breaks) {
  std::vector<Piece> pieces;
  bool open = false;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const bool there = std::isfinite(y[i]) && std::isfinite(x[i]);
    if (open && there && (breaks.empty() || breaks[i] == 0)) {
      pieces.back().end = i + 1;
    } else if (there) {
      pieces.push_back({i, i + 1});
    }
    open = there;
  }
  return pieces;
}

/// Indices of what stays of the values [begin, end) that share a column.
void keep_extremes(std::span<const double> x, std::span<const double> y, std::size_t begin,
                   std::size_t end, Line* line) {
  std::size_t low = begin, high = begin;
  for (std::size_t i = begin; i < end; ++i) {
    if (y[i] < y[low]) low = i;
    if (y[i] > y[high]) high = i;
  }
  std::array<std::size_t, 4> kept{begin, std::min(low, high), std::max(low, high), end - 1};
  const auto last = std::unique(kept.begin(), kept.end());
  for (auto k = kept.begin(); k != last; ++k) line->push_back({x[*k], y[*k]});
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

std::size_t points_in(const std::vector<Line>& lines) {
  std::size_t n = 0;
  for (const Line& line : lines) n += line.size();
  return n;
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
      keep_extremes(x, y, begin, i, &line);
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<Line> thin(std::span<const double> x, std::span<const double> y,
                       std::span<const std::uint8_t> breaks, double step, std::size_t most) {
  assert(x.size() == y.size() && (breaks.empty() || breaks.size() == y.size()) && step > 0);
  constexpr int kDoublings = 40;  // 10¹² times the first step: wider than any map
  const std::vector<Piece> pieces = pieces_of(x, y, breaks);
  std::vector<Line> lines = thinned(x, y, pieces, step);
  for (int i = 0; i < kDoublings && points_in(lines) > most; ++i)
    lines = thinned(x, y, pieces, step *= 2);
  return lines;
}

}  // namespace vergence::app::report
