#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/features/detail/align_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "core/features/detail/align_kernel.hpp"
#include "core/math/pairwise_sum.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::features::detail {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// A row of the window has 16 floats; the number of lanes always divides it.
using Tag = hn::CappedTag<float, kWindowStride>;
// Rows with a border of one pixel for the gradients.
constexpr int kRows = kWindow + 2;

/// Samples the patch bilinearly on the rotated grid: kRows × (kWindowStride + 2), of which kRows
/// columns are used.
void sample_patch(const std::uint8_t* patch, float cx, float cy, const float B[4], float* out) {
  const Tag d;
  const hn::RebindToSigned<Tag> d32;
  const int lanes = static_cast<int>(hn::Lanes(d));
  constexpr float kHalf = 0.5F * static_cast<float>(kRows - 1);
  const auto zero = hn::Zero(d), last = hn::Set(d, kPatchSide - 1.001F);
  const auto byte = hn::Set(d32, 0xFF);
  // Load four bytes at once, of which the lower two are neighbours in x. kPatchBytes has room after
  // the last pixel.
  const auto* base = reinterpret_cast<const std::int32_t*>(patch);
  for (int c = 0; c < kWindowStride; c += lanes) {
    const auto dx = hn::Add(hn::Iota(d, 0.F), hn::Set(d, static_cast<float>(c) - kHalf));
    const auto x_row = hn::MulAdd(hn::Set(d, B[0]), dx, hn::Set(d, cx));
    const auto y_row = hn::MulAdd(hn::Set(d, B[2]), dx, hn::Set(d, cy));
    for (int r = 0; r < kRows; ++r) {
      const auto dy = hn::Set(d, static_cast<float>(r) - kHalf);
      const auto x = hn::Min(hn::Max(hn::MulAdd(hn::Set(d, B[1]), dy, x_row), zero), last);
      const auto y = hn::Min(hn::Max(hn::MulAdd(hn::Set(d, B[3]), dy, y_row), zero), last);
      const auto ix = hn::ConvertTo(d32, x), iy = hn::ConvertTo(d32, y);
      const auto fx = hn::Sub(x, hn::ConvertTo(d, ix)), fy = hn::Sub(y, hn::ConvertTo(d, iy));
      static_assert(kPatchSide == 28, "28 y = 32 y - 4 y");
      const auto offset = hn::Add(hn::Sub(hn::ShiftLeft<5>(iy), hn::ShiftLeft<2>(iy)), ix);
      const auto upper = hn::GatherOffset(d32, base, offset);
      const auto lower = hn::GatherOffset(d32, base, hn::Add(offset, hn::Set(d32, kPatchSide)));
      const auto lerped = [&](hn::Vec<decltype(d32)> four) {
        const auto a = hn::ConvertTo(d, hn::And(four, byte));
        const auto b = hn::ConvertTo(d, hn::And(hn::ShiftRight<8>(four), byte));
        return hn::MulAdd(fx, hn::Sub(b, a), a);
      };
      const auto top = lerped(upper), bottom = lerped(lower);
      hn::StoreU(hn::MulAdd(fy, hn::Sub(bottom, top), top), d, out + r * (kWindowStride + 2) + c);
    }
  }
}

/// Sums over a window by columns, reduced in an order independent of the vector width. Targets with
/// fused multiply-add (AVX2, AVX3, NEON) give the same bits.
struct ColumnSums {
  HWY_ALIGN float of[kWindowStride];

  HWY_INLINE void keep(hn::Vec<Tag> column, int c) { hn::Store(column, Tag(), of + c); }
  [[nodiscard]] float all() const { return pairwise_sum<kWindowStride>(of); }
};

void MakeWindow(const std::uint8_t* patch, float cx, float cy, const float B[4], Window* w) {
  static_assert(kRows <= kWindowStride);
  constexpr int kStride = kWindowStride + 2;
  HWY_ALIGN float t[kRows * kStride + kWindowStride];
  for (int i = kRows * kStride; i < kRows * kStride + kWindowStride; ++i) t[i] = 0.F;
  for (int r = 0; r < kRows; ++r)
    t[r * kStride + kWindowStride] = t[r * kStride + kWindowStride + 1] = 0.F;
  sample_patch(patch, cx, cy, B, t);
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  HWY_ALIGN float mask[kWindowStride];
  for (int c = 0; c < kWindowStride; ++c) mask[c] = c < kWindow ? 1.F : 0.F;

  ColumnSums first, second, third;
  const auto half = hn::Set(d, 0.5F);
  for (int c = 0; c < kWindowStride; c += lanes) {
    const auto m = hn::Load(d, mask + c);
    auto sum_t = hn::Zero(d), sum_x = hn::Zero(d), sum_y = hn::Zero(d);
    for (int r = 0; r < kWindow; ++r) {
      const float* p = t + (r + 1) * kStride + c + 1;
      const auto v = hn::Mul(m, hn::LoadU(d, p));
      const auto gx = hn::Mul(hn::Mul(m, half), hn::Sub(hn::LoadU(d, p + 1), hn::LoadU(d, p - 1)));
      const auto gy =
          hn::Mul(hn::Mul(m, half), hn::Sub(hn::LoadU(d, p + kStride), hn::LoadU(d, p - kStride)));
      hn::Store(v, d, w->value + r * kWindowStride + c);
      hn::Store(gx, d, w->steep_x + r * kWindowStride + c);
      hn::Store(gy, d, w->steep_y + r * kWindowStride + c);
      sum_t = hn::Add(sum_t, v);
      sum_x = hn::Add(sum_x, gx);
      sum_y = hn::Add(sum_y, gy);
    }
    first.keep(sum_t, c), second.keep(sum_x, c), third.keep(sum_y, c);
  }
  constexpr float kShare = 1.F / (kWindow * kWindow);
  const auto mean_t = hn::Set(d, kShare * first.all()), mean_x = hn::Set(d, kShare * second.all()),
             mean_y = hn::Set(d, kShare * third.all());

  for (int c = 0; c < kWindowStride; c += lanes) {
    const auto m = hn::Load(d, mask + c);
    auto tt = hn::Zero(d), tx = hn::Zero(d), ty = hn::Zero(d);
    for (int r = 0; r < kWindow; ++r) {
      const int i = r * kWindowStride + c;
      const auto v = hn::Mul(m, hn::Sub(hn::Load(d, w->value + i), mean_t));
      const auto gx = hn::Mul(m, hn::Sub(hn::Load(d, w->steep_x + i), mean_x));
      const auto gy = hn::Mul(m, hn::Sub(hn::Load(d, w->steep_y + i), mean_y));
      hn::Store(v, d, w->value + i);
      hn::Store(gx, d, w->steep_x + i);
      hn::Store(gy, d, w->steep_y + i);
      tt = hn::MulAdd(v, v, tt);
      tx = hn::MulAdd(v, gx, tx);
      ty = hn::MulAdd(v, gy, ty);
    }
    first.keep(tt, c), second.keep(tx, c), third.keep(ty, c);
  }
  w->variance_sum = first.all();
  const float inverse = w->variance_sum > 1e-3F ? 1.F / w->variance_sum : 0.F;
  const auto along_x = hn::Set(d, second.all() * inverse);
  const auto along_y = hn::Set(d, third.all() * inverse);
  for (int c = 0; c < kWindowStride; c += lanes) {
    auto xx = hn::Zero(d), xy = hn::Zero(d), yy = hn::Zero(d);
    for (int r = 0; r < kWindow; ++r) {
      const int i = r * kWindowStride + c;
      const auto v = hn::Load(d, w->value + i);
      const auto sx = hn::NegMulAdd(along_x, v, hn::Load(d, w->steep_x + i));
      const auto sy = hn::NegMulAdd(along_y, v, hn::Load(d, w->steep_y + i));
      hn::Store(sx, d, w->steep_x + i);
      hn::Store(sy, d, w->steep_y + i);
      xx = hn::MulAdd(sx, sx, xx);
      xy = hn::MulAdd(sx, sy, xy);
      yy = hn::MulAdd(sy, sy, yy);
    }
    first.keep(xx, c), second.keep(xy, c), third.keep(yy, c);
  }
  w->hxx = first.all();
  w->hxy = second.all();
  w->hyy = third.all();
}

void WindowSumsAt(const Window& w, const std::uint8_t* at, std::ptrdiff_t stride, float fx,
                  float fy, WindowSums* sums) {
  const Tag d;
  const hn::Rebind<std::int32_t, Tag> d32;
  const hn::Rebind<std::uint8_t, Tag> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto vfx = hn::Set(d, fx), vfy = hn::Set(d, fy);
  ColumnSums steep_x, steep_y, value, sum, square;
  HWY_ALIGN float mask[kWindowStride];
  for (int c = 0; c < kWindowStride; ++c) mask[c] = c < kWindow ? 1.F : 0.F;
  for (int c = 0; c < kWindowStride; c += lanes) {
    const auto m = hn::Load(d, mask + c);
    const auto lerped = [&](const std::uint8_t* p) {
      const auto a = hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, p)));
      const auto b = hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, p + 1)));
      return hn::MulAdd(vfx, hn::Sub(b, a), a);
    };
    auto sx = hn::Zero(d), sy = hn::Zero(d), sv = hn::Zero(d), s1 = hn::Zero(d), s2 = hn::Zero(d);
    auto above = lerped(at + c);
    for (int r = 0; r < kWindow; ++r) {
      const auto below = lerped(at + (r + 1) * stride + c);
      const auto v = hn::Mul(m, hn::MulAdd(vfy, hn::Sub(below, above), above));
      const int i = r * kWindowStride + c;
      sx = hn::MulAdd(v, hn::Load(d, w.steep_x + i), sx);
      sy = hn::MulAdd(v, hn::Load(d, w.steep_y + i), sy);
      sv = hn::MulAdd(v, hn::Load(d, w.value + i), sv);
      s1 = hn::Add(s1, v);
      s2 = hn::MulAdd(v, v, s2);
      above = below;
    }
    steep_x.keep(sx, c), steep_y.keep(sy, c), value.keep(sv, c), sum.keep(s1, c),
        square.keep(s2, c);
  }
  *sums = {steep_x.all(), steep_y.all(), value.all(), sum.all(), square.all()};
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::features::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::features::detail {
HWY_EXPORT(MakeWindow);
HWY_EXPORT(WindowSumsAt);

void make_window(const std::uint8_t* patch, float centre_x, float centre_y, const float B[4],
                 Window* window) noexcept {
  HWY_DYNAMIC_DISPATCH(MakeWindow)(patch, centre_x, centre_y, B, window);
}

void window_sums(const Window& window, const std::uint8_t* at, std::ptrdiff_t stride, float fx,
                 float fy, WindowSums* sums) noexcept {
  HWY_DYNAMIC_DISPATCH(WindowSumsAt)(window, at, stride, fx, fy, sums);
}
}  // namespace vergence::features::detail
#endif
