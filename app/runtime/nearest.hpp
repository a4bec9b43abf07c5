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
    for (int n = 1; std::ranges::count(distinct, own) > 0; ++n) own = fmt::format("{}_{}", name, n);
    distinct.push_back(own);
  }
  return distinct;
}

/// Number of insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`, in
/// bytes and case-insensitively (optimal string alignment). Its time grows with the product of both
/// lengths; uses only the first 256 bytes of each.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// Known word closest to a mistyped one, the first of several. Empty if every word would need
/// changes to more than a third.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word,
                                                 const std::vector<std::string>& known);

/// Text `; did you mean "X"?` for a message, or "" if no word is close.
[[nodiscard]] std::string did_you_mean(std::string_view word,
                                       const std::vector<std::string>& known);

/// A name of an earlier version that a user may still write.
struct Renamed {
  enum class Kind { key, value, option } kind;
  // Former name, such as `record.roll_mb`, `sync.mode bus` or `run --page`.
  std::string_view name;
  // Current name.
  std::string_view now;
};

[[nodiscard]] std::span<const Renamed> renamed();

/// `; it is now …` for an error message about an unknown name; empty where it was not renamed.
[[nodiscard]] std::string new_name(Renamed::Kind kind, std::string_view name);

}  // namespace vergence::app
