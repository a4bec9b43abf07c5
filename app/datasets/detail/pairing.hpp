#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/types/time.hpp"

/// The order of stamps, and which image of one camera belongs to which of the other.
namespace vergence::app::detail {

/// Stamps of a pair may be apart by so much of the interval, 40 % with room for its own rounding:
/// half of it is the same to both neighbours.
inline constexpr double kMaxApart = 0.404;

/// The median step forward; 0.1 s where there is none.
[[nodiscard]] Duration usual_interval(std::span<const Stamp> stamps);

/// Indices of stamps that are each other's nearest and not farther apart than `most`, in the order
/// of the left ones.
[[nodiscard]] std::vector<std::array<std::size_t, 2>> pair_nearest(std::span<const Stamp> left,
                                                                   std::span<const Stamp> right,
                                                                   Duration most);

/// Indices of a longest strictly ascending part of the stamps: what stays when the fewest are left
/// out that go back or repeat one.
[[nodiscard]] std::vector<std::size_t> ascending(std::span<const Stamp> stamps);

/// By how much the right stamps of pairs are later.
struct PairOffset {
  Duration median{};    // signed
  Duration farthest{};  // the 95th percentile of the magnitude
};
[[nodiscard]] PairOffset pair_offset(std::span<const Stamp> left, std::span<const Stamp> right,
                                     std::span<const std::array<std::size_t, 2>> pairs);

/// "0.312 ms (median; 95 % within 0.4 ms)".
[[nodiscard]] std::string describe(const PairOffset& offset);

/// Stamps of pairs that are more than 5 ms or 10 % of the interval apart.
[[nodiscard]] bool is_suspicious(const PairOffset& offset, Duration interval);
/// Returns the warning about the two cameras.
[[nodiscard]] std::string pairing_warning(const std::string& left, const std::string& right,
                                          const PairOffset& offset, Duration interval);

}  // namespace vergence::app::detail
