#pragma once
#include <string_view>

namespace vergence::app::detail {

/// Whether `a` stands before `b` where runs of digits count as numbers, whether they have leading
/// zeros or not: `left/2.png` before `left/10.png`. A strict order: names of one number with and
/// without zeros differ, the one with fewer digits first.
[[nodiscard]] bool in_name_order(std::string_view a, std::string_view b) noexcept;

}  // namespace vergence::app::detail
