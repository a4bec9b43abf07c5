#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/types/time.hpp"

/// Order of stamps, and association of the images of two cameras.
namespace vergence::app::detail {

/// Maximum distance of a pair's stamps as a share of the interval: 40 % with room for rounding,
/// because at half of it both neighbours are equally near.
inline constexpr double kMaxApart = 0.404;

/// Median step forward; 0.1 s if there is none.
[[nodiscard]] Duration usual_interval(std::span<const Stamp> stamps);

/// Indices of mutually nearest stamps at most `most` apart, in the order of the left ones.
[[nodiscard]] std::vector<std::array<std::size_t, 2>> pair_nearest(std::span<const Stamp> left,
                                                                   std::span<const Stamp> right,
                                                                   Duration most);

/// Indices of a longest strictly increasing part of the stamps: the rest after removing the fewest
/// that decrease or repeat.
[[nodiscard]] std::vector<std::size_t> ascending(std::span<const Stamp> stamps);

/// Delay of the right stamps of pairs.
struct PairOffset {
  /// Signed.
  Duration median{};
  /// 95th percentile of the magnitude.
  Duration farthest{};
};
[[nodiscard]] PairOffset pair_offset(std::span<const Stamp> left, std::span<const Stamp> right,
                                     std::span<const std::array<std::size_t, 2>> pairs);

/// Text such as "0.312 ms (median; 95 % within 0.4 ms)".
[[nodiscard]] std::string describe(const PairOffset& offset);

/// Adds warnings if the stamps of pairs differ by more than 5 ms or 10 % of the interval, and if
/// images are alone.
void remark_pairs(const std::string& left, const std::string& right, const PairOffset& offset,
                  Duration interval, std::size_t alone, std::vector<std::string>* remarks);

}  // namespace vergence::app::detail
