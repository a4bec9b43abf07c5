#pragma once
#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace vergence::app {

/// Returns the names with duplicates numbered, so that topics and files of two cameras differ.
/// `left`, `left` → `left`, `left_1`.
[[nodiscard]] inline std::vector<std::string> distinct_names(
    const std::vector<std::string>& names) {
  std::vector<std::string> distinct;
  for (const std::string& name : names) {
    std::string own = name;
    for (int n = 1; std::count(distinct.begin(), distinct.end(), own) > 0; ++n)
      own = fmt::format("{}_{}", name, n);
    distinct.push_back(own);
  }
  return distinct;
}

/// Insertions, deletions, replacements and exchanges of neighbours that turn `a` into `b`, bytes,
/// upper and lower case alike (optimal string alignment). O(|a|·|b|) time, O(|b|) memory; only the
/// first 256 bytes of each are looked at.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word closest to a mistyped one; the first of several equally close. Nothing when every
/// word would have to be changed by more than half.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word,
                                                 const std::vector<std::string>& known);

/// `; did you mean "X"?` for a message, or "" when nothing is near.
[[nodiscard]] std::string did_you_mean(std::string_view word,
                                       const std::vector<std::string>& known);

}  // namespace vergence::app
