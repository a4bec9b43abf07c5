#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/features/detail/correlate_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "core/features/detail/correlate_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::features::detail {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void Correlate(const std::uint8_t* block, const std::uint8_t* image, std::ptrdiff_t stride,
               const std::int32_t* offsets, int n, BlockSums* sums) {
  // Eight pixels are one row: 16-bit lanes, products summed pairwise into 32 bits. Integers, so
  // equal on every target.
  const hn::CappedTag<std::int16_t, kBlock> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const hn::RepartitionToWide<decltype(d16)> d32;
  const int lanes = static_cast<int>(hn::Lanes(d16));
  const auto one = hn::Set(d16, 1);
  for (int k = 0; k < n; ++k) {
    const std::uint8_t* at = image + offsets[k];
    auto product = hn::Zero(d32), sum = hn::Zero(d32), square = hn::Zero(d32);
    auto product1 = hn::Zero(d32), sum1 = hn::Zero(d32), square1 = hn::Zero(d32);
    for (int r = 0; r < kBlock; ++r) {
      for (int c = 0; c < kBlock; c += lanes) {
        const auto t = hn::PromoteTo(d16, hn::LoadU(d8, block + r * kBlock + c));
        const auto i = hn::PromoteTo(d16, hn::LoadU(d8, at + r * stride + c));
        product = hn::ReorderWidenMulAccumulate(d32, t, i, product, product1);
        square = hn::ReorderWidenMulAccumulate(d32, i, i, square, square1);
        sum = hn::ReorderWidenMulAccumulate(d32, one, i, sum, sum1);
      }
    }
    sums[k] = {hn::GetLane(hn::SumOfLanes(d32, hn::Add(product, product1))),
               hn::GetLane(hn::SumOfLanes(d32, hn::Add(sum, sum1))),
               hn::GetLane(hn::SumOfLanes(d32, hn::Add(square, square1)))};
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::features::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::features::detail {
HWY_EXPORT(Correlate);

void correlate(const std::uint8_t* block, const std::uint8_t* image, std::ptrdiff_t stride,
               const std::int32_t* offsets, int n, BlockSums* sums) noexcept {
  HWY_DYNAMIC_DISPATCH(Correlate)(block, image, stride, offsets, n, sums);
}
}  // namespace vergence::features::detail
#endif
