#pragma once
#include <cmath>
#include <cstdint>

namespace vergence {

/// Seeded generator with equal results on every platform, unlike the standard's distributions:
/// PCG32 (O'Neill 2014, XSH RR).
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 1) noexcept
      : state_(0), increment_((stream << 1U) | 1U) {
    (void)next();
    state_ += seed;
    (void)next();
  }

  [[nodiscard]] std::uint32_t next() noexcept {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto x = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto r = static_cast<std::uint32_t>(old >> 59U);
    return (x >> r) | (x << ((32U - r) & 31U));
  }
  /// Uniform in [0, n), n > 0, with a bias below n / 2³².
  [[nodiscard]] std::uint32_t below(std::uint32_t n) noexcept {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * n) >> 32U);
  }
  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform() noexcept {
    const std::uint64_t hi = next() >> 5U, lo = next() >> 6U;
    return static_cast<double>((hi << 26U) | lo) * 0x1.0p-53;
  }
  [[nodiscard]] double uniform(double lo, double hi) noexcept { return lo + (hi - lo) * uniform(); }
  /// Standard normal by Marsaglia's polar method, which takes 1.27 iterations on average, at most
  /// 64.
  [[nodiscard]] double normal() noexcept {
    for (int i = 0; i < 64; ++i) {
      const double u = uniform(-1, 1), v = uniform(-1, 1), s = u * u + v * v;
      if (s > 0 && s < 1) return u * std::sqrt(-2.0 * std::log(s) / s);
    }
    return 0.0;
  }

 private:
  std::uint64_t state_, increment_;
};

}  // namespace vergence
