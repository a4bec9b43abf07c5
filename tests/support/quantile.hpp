#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

namespace vergence::test {

/// The value below which `share` of the values lie; 0 if there are none.
template <class Number>
[[nodiscard]] double quantile(std::vector<Number> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace vergence::test
