#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/features/detail/correlate_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "core/features/detail/correlate_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::features::detail {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Σ T·I, Σ I and Σ I² at one position. Eight pixels are one row: 16-bit lanes, with products
/// summed pairwise into 32 bits. With 16 lanes per vector, two rows are summed at a time.
template <class D8, class Load>
HWY_INLINE void SumsAt(D8 d8, const std::uint8_t* block, Load load, std::int32_t* product,
                       std::int32_t* sum, std::int32_t* square) {
  const hn::Rebind<std::int16_t, D8> d16;
  const hn::RepartitionToWide<decltype(d16)> d32;
  const int lanes = static_cast<int>(hn::Lanes(d16));
  const auto one = hn::Set(d16, 1);
  auto p = hn::Zero(d32), s = hn::Zero(d32), q = hn::Zero(d32);
  auto p1 = hn::Zero(d32), s1 = hn::Zero(d32), q1 = hn::Zero(d32);
#pragma GCC unroll 8
  for (int at = 0; at < kBlock * kBlock; at += lanes) {
    const auto t = hn::PromoteTo(d16, hn::LoadU(d8, block + at));
    const auto i = hn::PromoteTo(d16, load(at));
    p = hn::ReorderWidenMulAccumulate(d32, t, i, p, p1);
    q = hn::ReorderWidenMulAccumulate(d32, i, i, q, q1);
    s = hn::ReorderWidenMulAccumulate(d32, one, i, s, s1);
  }
  *product = hn::GetLane(hn::SumOfLanes(d32, hn::Add(p, p1)));
  *sum = hn::GetLane(hn::SumOfLanes(d32, hn::Add(s, s1)));
  *square = hn::GetLane(hn::SumOfLanes(d32, hn::Add(q, q1)));
}

void Correlate(const Block& block, const std::uint8_t* image, std::ptrdiff_t stride,
               const std::int32_t* offsets, int n, float* scores) {
  const hn::CappedTag<std::int32_t, kPlacesAtATime> d32;
  const hn::RebindToFloat<decltype(d32)> df;
  const int lanes = static_cast<int>(hn::Lanes(d32));
  constexpr auto kN = static_cast<float>(kBlock * kBlock);
  const auto count = hn::Set(df, kN), block_sum = hn::Set(df, block.sum), zero = hn::Zero(df);
  HWY_ALIGN std::int32_t product[kPlacesAtATime] = {}, sum[kPlacesAtATime] = {},
                         square[kPlacesAtATime] = {};
  for (int first = 0; first < n; first += kPlacesAtATime) {
    for (int k = 0; k < HWY_MIN(kPlacesAtATime, n - first); ++k) {
      const std::uint8_t* at = image + offsets[first + k];
#if HWY_TARGET <= HWY_AVX2 && HWY_ARCH_X86
      const hn::FixedTag<std::uint8_t, 16> d8;
      const hn::Half<decltype(d8)> row;
      const auto load = [&](int pixel) HWY_ATTR {
        const std::uint8_t* rows = at + pixel / kBlock * stride;
        return hn::Combine(d8, hn::LoadU(row, rows + stride), hn::LoadU(row, rows));
      };
#else
      const hn::CappedTag<std::int16_t, kBlock> d16;
      const hn::Rebind<std::uint8_t, decltype(d16)> d8;
      const auto load = [&](int pixel) HWY_ATTR {
        return hn::LoadU(d8, at + pixel / kBlock * stride + pixel % kBlock);
      };
#endif
      SumsAt(d8, block.pixels, load, product + k, sum + k, square + k);
    }
    for (int k = 0; k < kPlacesAtATime; k += lanes) {
      const auto s = hn::ConvertTo(df, hn::Load(d32, sum + k));
      const auto p = hn::ConvertTo(df, hn::Load(d32, product + k));
      const auto q = hn::ConvertTo(df, hn::Load(d32, square + k));
      const auto variance = hn::Sub(hn::Mul(count, q), hn::Mul(s, s));
      const auto common = hn::Max(hn::Sub(hn::Mul(count, p), hn::Mul(block_sum, s)), zero);
      const auto norm = hn::Mul(hn::Set(df, block.variance), variance);
      hn::StoreU(hn::IfThenElseZero(hn::Gt(norm, hn::Set(df, 1.F)),
                                    hn::Div(hn::Mul(common, common), norm)),
                 df, scores + first + k);
    }
  }
}

float Highest(const float* scores, int n) {
  const hn::CappedTag<float, kPlacesAtATime> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  auto highest = hn::Zero(d);
  int i = 0;
  for (; i + lanes <= n; i += lanes) highest = hn::Max(highest, hn::LoadU(d, scores + i));
  float result = hn::GetLane(hn::MaxOfLanes(d, highest));
  for (; i < n; ++i) result = HWY_MAX(result, scores[i]);
  return result;
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::features::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::features::detail {
HWY_EXPORT(Correlate);
HWY_EXPORT(Highest);

void correlate(const Block& block, const std::uint8_t* image, std::ptrdiff_t stride,
               const std::int32_t* offsets, int n, float* scores) noexcept {
  HWY_DYNAMIC_DISPATCH(Correlate)(block, image, stride, offsets, n, scores);
}

float highest(const float* scores, int n) noexcept {
  return HWY_DYNAMIC_DISPATCH(Highest)(scores, n);
}
}  // namespace vergence::features::detail
#endif
