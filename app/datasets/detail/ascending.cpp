#include "app/datasets/detail/ascending.hpp"

#include <algorithm>

namespace vergence::app::detail {

std::vector<std::size_t> ascending(std::span<const Stamp> stamps) {
  std::vector<std::size_t> ends, before(stamps.size());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto place = std::lower_bound(ends.begin(), ends.end(), stamps[i],
                                        [&](std::size_t e, Stamp s) { return stamps[e] < s; });
    before[i] = place == ends.begin() ? i : *(place - 1);
    if (place == ends.end())
      ends.push_back(i);
    else if (stamps[i] < stamps[*place])  // of equal ones the first stays
      *place = i;
  }
  std::vector<std::size_t> kept(ends.size());
  if (ends.empty()) return kept;
  std::size_t at = ends.back();
  for (std::size_t n = kept.size(); n-- > 0; at = before[at]) kept[n] = at;
  return kept;
}

}  // namespace vergence::app::detail
