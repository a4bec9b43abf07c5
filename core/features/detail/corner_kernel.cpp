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

/// Products xx, xy and yy of the gradients of one image row from x0 − radius on, n of them rounded
/// up to whole vectors.
void gradient_products(const ImageView& image, int x, int y, int n, float* xx, float* xy,
                       float* yy) {
  const Tag d;
  const hn::Rebind<std::int32_t, Tag> d32;
  const hn::Rebind<std::uint8_t, Tag> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const std::uint8_t* above = image.row(y - 1) + x;
  const std::uint8_t* here = image.row(y) + x;
  const std::uint8_t* below = image.row(y + 1) + x;
  const auto half = hn::Set(d, 0.5F);
  for (int i = 0; i < n; i += lanes) {
    const auto load = [&](const std::uint8_t* p) {
      return hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, p)));
    };
    const auto gx = hn::Mul(half, hn::Sub(load(here + i + 1), load(here + i - 1)));
    const auto gy = hn::Mul(half, hn::Sub(load(below + i), load(above + i)));
    hn::StoreU(hn::Mul(gx, gx), d, xx + i);
    hn::StoreU(hn::Mul(gx, gy), d, xy + i);
    hn::StoreU(hn::Mul(gy, gy), d, yy + i);
  }
}

void CornerScores(const ImageView& image, int x0, int y0, int w, int h, float* score,
                  float* bound) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const int columns = w + 2 * kTensorRadius;
  // Ring buffer with the products of the seven image rows under the window.
  HWY_ALIGN float ring[kWindowSide][3][kColumns];
  HWY_ALIGN float column_sum[3][kColumns];
  for (int p = 0; p < 3; ++p)
    for (int i = 0; i < columns; i += lanes) hn::StoreU(hn::Zero(d), d, column_sum[p] + i);
  HWY_ALIGN float newest[3][kColumns];
  for (int row = 0; row < h + kWindowSide - 1; ++row) {
    float(*oldest)[kColumns] = ring[row % kWindowSide];
    gradient_products(image, x0 - kTensorRadius, y0 - kTensorRadius + row, columns, newest[0],
                      newest[1], newest[2]);
    // The sums are multiples of 1/4 below 2²⁴/4 and thus exact in float, so adding the new row and
    // subtracting the old one leaves no error.
    for (int p = 0; p < 3; ++p) {
      for (int i = 0; i < columns; i += lanes) {
        const auto in = hn::LoadU(d, newest[p] + i);
        auto s = hn::Add(hn::LoadU(d, column_sum[p] + i), in);
        if (row >= kWindowSide) s = hn::Sub(s, hn::LoadU(d, oldest[p] + i));
        hn::StoreU(s, d, column_sum[p] + i);
        hn::StoreU(in, d, oldest[p] + i);
      }
    }
    const int y = row - (kWindowSide - 1);
    if (y < 0) continue;
    const auto scale = hn::Set(d, 1.F / (kWindowSide * kWindowSide));
    const auto half = hn::Set(d, 0.5F);
    auto highest = hn::Zero(d);
    for (int x = 0; x < w; x += lanes) {
      const auto sum = [&](const float* p) {
        auto s = hn::LoadU(d, p + x);
        for (int k = 1; k < kWindowSide; ++k) s = hn::Add(s, hn::LoadU(d, p + x + k));
        return hn::Mul(scale, s);
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
