#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/features/detail/downsample.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "core/features/detail/downsample.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::features::detail {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Number of entries before and after the row, for mirrored pixels and whole vectors.
constexpr int kMargin = 64;

/// Column sums of five rows with weights 1 4 6 4 1: at most 255 · 16.
void filter_rows(const std::uint8_t* const rows[5], int width, std::uint16_t* out) {
  const hn::ScalableTag<std::uint16_t> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const int lanes = static_cast<int>(hn::Lanes(d16));
  int x = 0;
  for (; x + lanes <= width; x += lanes) {
    const auto load = [&](int r) { return hn::PromoteTo(d16, hn::LoadU(d8, rows[r] + x)); };
    const auto outer = hn::Add(load(0), load(4));
    const auto inner = hn::Add(load(1), load(3));
    const auto mid = load(2);
    const auto six = hn::Add(hn::ShiftLeft<2>(mid), hn::ShiftLeft<1>(mid));
    hn::StoreU(hn::Add(hn::Add(outer, six), hn::ShiftLeft<2>(inner)), d16, out + x);
  }
  for (; x < width; ++x)
    out[x] = static_cast<std::uint16_t>(rows[0][x] + rows[4][x] + 4 * (rows[1][x] + rows[3][x]) +
                                        6 * rows[2][x]);
}

/// Filters every second pixel of the row the same way; v[-2] … v[width + 1] are valid.
void filter_columns(const std::uint16_t* v, int out_width, std::uint8_t* out) {
  const hn::ScalableTag<std::uint16_t> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const int lanes = static_cast<int>(hn::Lanes(d16));
  int x = 0;
  for (; x + lanes <= out_width; x += lanes) {
    hn::Vec<decltype(d16)> even_before, odd_before, even, odd, even_after, odd_after;
    hn::LoadInterleaved2(d16, v + 2 * x - 2, even_before, odd_before);
    hn::LoadInterleaved2(d16, v + 2 * x, even, odd);
    hn::LoadInterleaved2(d16, v + 2 * x + 2, even_after, odd_after);
    const auto outer = hn::Add(even_before, even_after);
    const auto inner = hn::Add(odd_before, odd);
    const auto six = hn::Add(hn::ShiftLeft<2>(even), hn::ShiftLeft<1>(even));
    const auto sum =
        hn::Add(hn::Add(outer, six), hn::Add(hn::ShiftLeft<2>(inner), hn::Set(d16, 128)));
    hn::StoreU(
        hn::DemoteTo(d8, hn::BitCast(hn::RebindToSigned<decltype(d16)>(), hn::ShiftRight<8>(sum))),
        d8, out + x);
  }
  for (; x < out_width; ++x) {
    const int i = 2 * x;
    out[x] = static_cast<std::uint8_t>(
        (v[i - 2] + v[i + 2] + 4 * (v[i - 1] + v[i + 1]) + 6 * v[i] + 128) >> 8);
  }
}

int mirror(int i, int n) { return i < 0 ? -i : (i >= n ? 2 * (n - 1) - i : i); }

void Downsample(const ImageView& from, std::uint8_t* out, const ImageView& to, std::uint16_t* row) {
  std::uint16_t* v = row + kMargin;
  for (int y = 0; y < to.height; ++y) {
    const std::uint8_t* rows[5];
    for (int k = 0; k < 5; ++k) rows[k] = from.row(mirror(2 * y + k - 2, from.height));
    filter_rows(rows, from.width, v);
    v[-1] = v[1];
    v[-2] = v[2];
    v[from.width] = v[from.width - 2];
    v[from.width + 1] = v[from.width - 3];
    filter_columns(v, to.width, out + y * to.stride);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::features::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::features::detail {
HWY_EXPORT(Downsample);

std::size_t filtered_row_length(int width) noexcept {
  return static_cast<std::size_t>(width) + 2 * 64 + 2;
}

void downsample(const ImageView& from, std::uint8_t* out, const ImageView& to,
                std::uint16_t* row) noexcept {
  HWY_DYNAMIC_DISPATCH(Downsample)(from, out, to, row);
}
}  // namespace vergence::features::detail
#endif
