#pragma once
#include <bit>
#include <concepts>
#include <cstdint>
#include <span>

#include <hwy/targets.h>

/// Tests of kernels that Highway compiles once per instruction set.
namespace vergence::test {

/// Runs `body(name)` once on every SIMD target that this machine has and the program is built for,
/// the portable one (EMU128) last, and leaves the choice as it was.
template <class Body>
void on_every_target(const Body& body) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    body(hwy::TargetName(target));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

/// FNV-1a over the bits of numbers: two runs with equal fingerprints gave the same bits, also where
/// they ran on two machines.
class Fingerprint {
 public:
  template <std::integral Number>
  void add(Number n) noexcept {
    for (std::size_t i = 0; i < sizeof(Number); ++i)
      value_ = (value_ ^ ((static_cast<std::uint64_t>(n) >> (8 * i)) & 0xFFU)) * 0x100000001B3ULL;
  }
  void add(float x) noexcept { add(std::bit_cast<std::uint32_t>(x)); }
  void add(double x) noexcept { add(std::bit_cast<std::uint64_t>(x)); }
  template <class Number>
  void add(std::span<const Number> numbers) noexcept {
    for (const Number n : numbers) add(n);
  }
  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325ULL;
};

}  // namespace vergence::test
