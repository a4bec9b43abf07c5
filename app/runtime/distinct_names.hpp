#pragma once
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace vergence::app {

/// The same names, each once: what makes topics or files of them would put two cameras into one.
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

}  // namespace vergence::app
