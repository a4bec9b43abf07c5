#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/features/detail/corner_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "core/features/detail/corner_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::features::detail {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kColumns = kMaxBlock + 32;  // floats a row of the working buffers: block, window and whole vectors
constexpr int kWindowSide = 2 * kTensorRadius + 1;
using Tag = hn::CappedTag<float, 16>;

/// Products of the gradients of one image row: xx, xy, yy at x0 − radius … , n of them rounded up to whole vectors.
void gradient_products(const ImageView& image, int x, int y, int n, float* xx, float* xy, float* yy) {
  const Tag d;
  const hn::Rebind<std::int32_t, Tag> d32;
  const hn::Rebind<std::uint8_t, Tag> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const std::uint8_t* above = image.row(y - 1) + x;
  const std::uint8_t* here = image.row(y) + x;
  const std::uint8_t* below = image.row(y + 1) + x;
  const auto half = hn::Set(d, 0.5F);
  for (int i = 0; i < n; i += lanes) {
    const auto load = [&](const std::uint8_t* p) { return hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, p))); };
    const auto gx = hn::Mul(half, hn::Sub(load(here + i + 1), load(here + i - 1)));
    const auto gy = hn::Mul(half, hn::Sub(load(below + i), load(above + i)));
    hn::StoreU(hn::Mul(gx, gx), d, xx + i);
    hn::StoreU(hn::Mul(gx, gy), d, xy + i);
    hn::StoreU(hn::Mul(gy, gy), d, yy + i);
  }
}

void CornerScores(const ImageView& image, int x0, int y0, int w, int h, float* score) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const int columns = w + 2 * kTensorRadius;
  // A ring of rows: the products of the seven image rows under the window.
  HWY_ALIGN float ring[kWindowSide][3][kColumns];
  HWY_ALIGN float column_sum[3][kColumns];
  for (int r = 0; r < kWindowSide - 1; ++r)
    gradient_products(image, x0 - kTensorRadius, y0 - kTensorRadius + r, columns, ring[r][0], ring[r][1], ring[r][2]);
  for (int y = 0; y < h; ++y) {
    float(*newest)[kColumns] = ring[(y + kWindowSide - 1) % kWindowSide];
    gradient_products(image, x0 - kTensorRadius, y0 + y + kTensorRadius, columns, newest[0], newest[1], newest[2]);
    for (int p = 0; p < 3; ++p) {
      for (int i = 0; i < columns; i += lanes) {
        auto s = hn::LoadU(d, ring[0][p] + i);
        for (int r = 1; r < kWindowSide; ++r) s = hn::Add(s, hn::LoadU(d, ring[r][p] + i));
        hn::StoreU(s, d, column_sum[p] + i);
      }
    }
    const auto scale = hn::Set(d, 1.F / (kWindowSide * kWindowSide));
    const auto half = hn::Set(d, 0.5F);
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
      hn::StoreU(hn::Sub(mean, root), d, score + y * kMaxBlock + x);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::features::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::features::detail {
HWY_EXPORT(CornerScores);

void corner_scores(const ImageView& image, int x0, int y0, int w, int h, float* score) noexcept {
  HWY_DYNAMIC_DISPATCH(CornerScores)(image, x0, y0, w, h, score);
}
}  // namespace vergence::features::detail
#endif
