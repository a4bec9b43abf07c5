#pragma once
#include <cstddef>

namespace vergence {

/// Sums N = 2^k numbers by repeatedly adding the second half to the first, an order independent of
/// the vector width.
template <std::size_t N, class T>
[[nodiscard]] constexpr T pairwise_sum(const T* numbers) noexcept {
  static_assert(N >= 2 && (N & (N - 1)) == 0);
  T half[N / 2];
  for (std::size_t i = 0; i < N / 2; ++i) half[i] = numbers[i] + numbers[i + N / 2];
  if constexpr (N == 2)
    return half[0];
  else
    return pairwise_sum<N / 2>(half);
}

}  // namespace vergence
