#include "core/features/detail/surf_distance.hpp"

#include <cstddef>

namespace vergence::features::detail {

float squared_distance(const SurfDescriptor& a, const SurfDescriptor& b) noexcept {
  // Separate sums for every eighth number keep the order of additions the same for vectors of four
  // and eight.
  constexpr std::size_t kSums = 8;
  std::array<float, kSums> sums{};
  for (std::size_t i = 0; i < a.values.size(); i += kSums) {
    for (std::size_t k = 0; k < kSums; ++k) {
      const float d = a.values[i + k] - b.values[i + k];
      sums[k] += d * d;
    }
  }
  return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

}  // namespace vergence::features::detail
