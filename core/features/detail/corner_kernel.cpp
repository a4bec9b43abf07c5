#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/features/detail/corner_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "core/features/detail/corner_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::features::detail {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Number of floats per row of the working buffers: block, window and whole vectors.
constexpr int kColumns = kMaxBlock + 32;
constexpr int kWindowSide = 2 * kTensorRadius + 1;
using Tag = hn::CappedTag<float, 16>;

void CornerScores(const ImageView& image, int x0, int y0, int w, int h, float* score,
                  float* bound) {
  const Tag d;
  const hn::Rebind<std::int32_t, Tag> d32;
  const hn::Rebind<std::uint8_t, Tag> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto half = hn::Set(d, 0.5F);
  const int columns = w + 2 * kTensorRadius;
  // Ring buffer with the products of the seven image rows under the window.
  HWY_ALIGN float ring[kWindowSide][3][kColumns];
  HWY_ALIGN float column_sum[3][kColumns];
  for (int p = 0; p < 3; ++p)
    for (int i = 0; i < columns; i += lanes) hn::StoreU(hn::Zero(d), d, column_sum[p] + i);
  const auto load = [&](const std::uint8_t* p) {
    return hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, p)));
  };
  for (int row = 0; row < h + kWindowSide - 1; ++row) {
    float(*oldest)[kColumns] = ring[row % kWindowSide];
    const std::uint8_t* here = image.row(y0 - kTensorRadius + row) + x0 - kTensorRadius;
    for (int i = 0; i < columns; i += lanes) {
      const std::uint8_t* at = here + i;
      const auto gx = hn::Mul(half, hn::Sub(load(at + 1), load(at - 1)));
      const auto gy = hn::Mul(half, hn::Sub(load(at + image.stride), load(at - image.stride)));
      // The sums are multiples of 1/4 below 2²⁴/4 and thus exact in float, so adding the new row
      // and subtracting the old one leaves no error.
      const auto replace = [&](int product, hn::Vec<Tag> in) {
        float* sum = column_sum[product] + i;
        float* out = oldest[product] + i;
        auto s = hn::Add(hn::LoadU(d, sum), in);
        if (row >= kWindowSide) s = hn::Sub(s, hn::LoadU(d, out));
        hn::StoreU(s, d, sum);
        hn::StoreU(in, d, out);
      };
      replace(0, hn::Mul(gx, gx));
      replace(1, hn::Mul(gx, gy));
      replace(2, hn::Mul(gy, gy));
    }
    const int y = row - (kWindowSide - 1);
    if (y < 0) continue;
    const auto scale = hn::Set(d, 1.F / (kWindowSide * kWindowSide));
    auto highest = hn::Zero(d);
    for (int x = 0; x < w; x += lanes) {
      // These sums are exact as well, so their order is free.
      static_assert(kWindowSide == 7);
      const auto sum = [&](const float* p) {
        const auto at = [&](int k) { return hn::LoadU(d, p + x + k); };
        const auto first = hn::Add(hn::Add(at(0), at(1)), hn::Add(at(2), at(3)));
        return hn::Mul(scale, hn::Add(first, hn::Add(hn::Add(at(4), at(5)), at(6))));
      };
      const auto xx = sum(column_sum[0]), xy = sum(column_sum[1]), yy = sum(column_sum[2]);
      const auto mean = hn::Mul(half, hn::Add(xx, yy));
      const auto difference = hn::Mul(half, hn::Sub(xx, yy));
      const auto root = hn::Sqrt(hn::MulAdd(difference, difference, hn::Mul(xy, xy)));
      const auto eigenvalue = hn::Sub(mean, root);
      highest = hn::Max(highest, eigenvalue);
      hn::StoreU(eigenvalue, d, score + y * kMaxBlock + x);
    }
    bound[y] = hn::GetLane(hn::MaxOfLanes(d, highest));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::features::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::features::detail {
HWY_EXPORT(CornerScores);

void corner_scores(const ImageView& image, int x0, int y0, int w, int h, float* score,
                   float* bound) noexcept {
  HWY_DYNAMIC_DISPATCH(CornerScores)(image, x0, y0, w, h, score, bound);
}
}  // namespace vergence::features::detail
#endif
