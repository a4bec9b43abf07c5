#include "drivers/mock/world/detail/tile_kernel.hpp"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/mock/world/detail/tile_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace vergence::mock::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, kTile>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using VF = hn::Vec<F>;
using VI = hn::Vec<I>;
using MF = hn::Mask<F>;

/// Levels of detail that are coarser than one texel per pixel: what bilinear interpolation needs.
constexpr float kSoftness = 0.6F;
/// This is half a grey level of a full-scale surface.
constexpr float kNegligible = 1.0F / 512.0F;

HWY_INLINE VF dot(const std::array<float, 3>& a, VF x, VF y) {
  const F f;
  return hn::MulAdd(hn::Set(f, a[0]), x, hn::MulAdd(hn::Set(f, a[1]), y, hn::Set(f, a[2])));
}

/// log2 of the length whose square is given: exponent plus linear mantissa, off by at most 0.043.
/// Continuous, which is what counts.
HWY_INLINE VF half_log2(VF squared) {
  const F f;
  const I i;
  const VF bits = hn::ConvertTo(f, hn::BitCast(i, hn::Max(squared, hn::Set(f, 1e-12F))));
  return hn::MulSub(bits, hn::Set(f, 0.5F / 8388608.0F), hn::Set(f, 63.5F));
}

/// One axis of a rip-map look-up at one level: index and weight of the lower texel.
struct Axis {
  /// Words from the texture's first column or row.
  VI index;
  /// Weight of the upper neighbour.
  VF weight;
};

HWY_INLINE Axis axis_at(VF texels, VI level, int log2_size) {
  const F f;
  const I i;
  const VI size = hn::Set(i, 1 << log2_size);
  // 2^-level from its exponent bits
  const VF scale = hn::BitCast(f, hn::ShiftLeft<23>(hn::Sub(hn::Set(i, 127), level)));
  const VF at = hn::MulSub(texels, scale, hn::Set(f, 0.5F));
  const VF whole = hn::Floor(at);
  const VI level_size = hn::Shr(size, level);
  const VI inside = hn::And(hn::ConvertTo(i, whole), hn::Sub(level_size, hn::Set(i, 1)));
  const VI start = hn::Sub(hn::Add(size, size), hn::Add(level_size, level_size));
  return {hn::Add(start, inside), hn::Sub(at, whole)};
}

/// Bilinear from one word.
HWY_INLINE VF bilinear(VI word, VF wu, VF wv) {
  const F f;
  const I i;
  const VI byte = hn::Set(i, 255);
  const VF a = hn::ConvertTo(f, hn::And(word, byte));
  const VF b = hn::ConvertTo(f, hn::And(hn::ShiftRight<8>(word), byte));
  const VF c = hn::ConvertTo(f, hn::And(hn::ShiftRight<16>(word), byte));
  const VF d = hn::ConvertTo(f, hn::And(hn::ShiftRight<24>(word), byte));
  const VF low = hn::MulAdd(wu, hn::Sub(b, a), a), high = hn::MulAdd(wu, hn::Sub(d, c), c);
  return hn::MulAdd(wv, hn::Sub(high, low), low);
}

/// Brightness 0..255 at (u, v) texels, with levels of detail (lu, lv) along the two axes.
HWY_INLINE VF sample(const std::int32_t* words, std::int32_t base, int log2_w, int log2_h, VF u,
                     VF v, VF lu, VF lv) {
  const F f;
  const I i;
  lu = hn::Min(hn::Max(lu, hn::Zero(f)), hn::Set(f, static_cast<float>(log2_w)));
  lv = hn::Min(hn::Max(lv, hn::Zero(f)), hn::Set(f, static_cast<float>(log2_h)));
  const VI iu = hn::ConvertTo(i, lu), iv = hn::ConvertTo(i, lv);
  const VF tu = hn::Sub(lu, hn::ConvertTo(f, iu)), tv = hn::Sub(lv, hn::ConvertTo(f, iv));
  const VI one = hn::Set(i, 1);
  const Axis u0 = axis_at(u, iu, log2_w),
             u1 = axis_at(u, hn::Min(hn::Add(iu, one), hn::Set(i, log2_w)), log2_w);
  const Axis v0 = axis_at(v, iv, log2_h),
             v1 = axis_at(v, hn::Min(hn::Add(iv, one), hn::Set(i, log2_h)), log2_h);
  // Row of 2w words: shift instead of multiply.
  const auto row = [&](VI index) {
    return hn::Add(hn::ShiftLeftSame(index, log2_w + 1), hn::Set(i, base));
  };
  const VI r0 = row(v0.index), r1 = row(v1.index);
  const VF s00 = bilinear(hn::GatherIndex(i, words, hn::Add(r0, u0.index)), u0.weight, v0.weight);
  const VF s10 = bilinear(hn::GatherIndex(i, words, hn::Add(r0, u1.index)), u1.weight, v0.weight);
  const VF s01 = bilinear(hn::GatherIndex(i, words, hn::Add(r1, u0.index)), u0.weight, v1.weight);
  const VF s11 = bilinear(hn::GatherIndex(i, words, hn::Add(r1, u1.index)), u1.weight, v1.weight);
  const VF s0 = hn::MulAdd(tu, hn::Sub(s10, s00), s00), s1 = hn::MulAdd(tu, hn::Sub(s11, s01), s01);
  return hn::MulAdd(tv, hn::Sub(s1, s0), s0);
}

/// Footprint of a packet of rays on a polygon's texture. Aggregate-initialised: an implicit default
/// constructor is compiled for the baseline instruction set, where that of a vector is not inlined.
struct Footprint {
  VF distance, u, v, lu, lv;
};

HWY_INLINE Footprint footprint(const TileInput& in, const ProjectedPolygon& p, VF x, VF y, VF q) {
  const F f;
  const VF distance = hn::Div(hn::Set(f, 1.0F), q);
  const VF u = hn::Mul(dot(p.u, x, y), distance), v = hn::Mul(dot(p.v, x, y), distance);
  // ∂u/∂x = (U_x − u q_x)/q, per pixel
  const VF sx = hn::Mul(distance, hn::Set(f, in.pixel_x)),
           sy = hn::Mul(distance, hn::Set(f, in.pixel_y));
  const VF qx = hn::Set(f, p.q[0]), qy = hn::Set(f, p.q[1]);
  const VF ux = hn::Mul(sx, hn::NegMulAdd(u, qx, hn::Set(f, p.u[0]))),
           uy = hn::Mul(sy, hn::NegMulAdd(u, qy, hn::Set(f, p.u[1])));
  const VF vx = hn::Mul(sx, hn::NegMulAdd(v, qx, hn::Set(f, p.v[0]))),
           vy = hn::Mul(sy, hn::NegMulAdd(v, qy, hn::Set(f, p.v[1])));
  return {distance, u, v,
          hn::Add(half_log2(hn::MulAdd(ux, ux, hn::Mul(uy, uy))), hn::Set(f, kSoftness)),
          hn::Add(half_log2(hn::MulAdd(vx, vx, hn::Mul(vy, vy))), hn::Set(f, kSoftness))};
}

HWY_INLINE VF opacity(const TileInput& in, const ProjectedPolygon& p, VF x, VF y, VF q) {
  const F f;
  const Footprint at = footprint(in, p, x, y, q);
  const VF su = hn::Set(f, p.opacity_scale_u), sv = hn::Set(f, p.opacity_scale_v);
  const VF bu = half_log2(hn::Mul(su, su)), bv = half_log2(hn::Mul(sv, sv));
  return hn::Mul(
      hn::Set(f, 1.0F / 255.0F),
      sample(in.texture_words, p.opacity, p.opacity_log2_width, p.opacity_log2_height,
             hn::Mul(at.u, su), hn::Mul(at.v, sv), hn::Add(at.lu, bu), hn::Add(at.lv, bv)));
}

/// The surfaces of one packet's pixels, nearest first.
struct Layers {
  VF q0, q1, q2, q3;
  VF c0, c1, c2, c3;
  VI p0, p1, p2, p3;
};

HWY_INLINE void swap_where(MF m, VF& a, VF& b) {
  const VF t = hn::IfThenElse(m, b, a);
  b = hn::IfThenElse(m, a, b);
  a = t;
}
HWY_INLINE void swap_where(MF m, VI& a, VI& b) {
  const I i;
  const auto n = hn::RebindMask(i, m);
  const VI t = hn::IfThenElse(n, b, a);
  b = hn::IfThenElse(n, a, b);
  a = t;
}

/// Insertion by inverse depth; what falls off the end is hidden by three surfaces already. Stops
/// when nothing is carried on.
HWY_INLINE void insert(Layers& l, VF q, VF c, VI p) {
  const F f;
  const auto step = [&](VF& lq, VF& lc, VI& lp) HWY_ATTR {
    const MF nearer = hn::Gt(q, lq);
    swap_where(nearer, lq, q);
    swap_where(nearer, lc, c);
    swap_where(nearer, lp, p);
    return hn::AllFalse(f, hn::Gt(c, hn::Zero(f)));
  };
  if (step(l.q0, l.c0, l.p0)) return;
  if (step(l.q1, l.c1, l.p1)) return;
  if (step(l.q2, l.c2, l.p2)) return;
  (void)step(l.q3, l.c3, l.p3);
}

/// Share on the inner side of an edge at signed distance e (px) in a pixel blurred by two unit
/// boxes, its own aperture and the lens: the integral of a triangle. Its samples at whole pixels
/// add up to the exact distance, so an edge is seen where it is at every sub-pixel phase (a ramp of
/// any other width sways by some 0.05 px).
HWY_INLINE VF inner_part(VF e) {
  const F f;
  const VF one = hn::Set(f, 1.0F), half = hn::Set(f, 0.5F);
  e = hn::Min(hn::Max(e, hn::Neg(one)), one);
  return hn::MulAdd(e, hn::NegMulAdd(half, hn::Abs(e), one), half);
}

HWY_INLINE VF coverage(const ProjectedPolygon& p, VF x, VF y) {
  const F f;
  const VF e0 = inner_part(dot(p.edge[0], x, y)), e1 = inner_part(dot(p.edge[1], x, y));
  const VF e2 = inner_part(dot(p.edge[2], x, y)), e3 = inner_part(dot(p.edge[3], x, y));
  const VF one = hn::Set(f, 1.0F), zero = hn::Zero(f);
  // Opposite edges: what both leave of a pixel, exact for parallel ones, also for strips thinner
  // than a pixel.
  const VF across = hn::Max(zero, hn::Sub(hn::Add(e0, e2), one)),
           along = hn::Max(zero, hn::Sub(hn::Add(e1, e3), one));
  return hn::Mul(across, along);
}

HWY_INLINE Layers find_layers(const TileInput& in, VF x, VF y) {
  const F f;
  const I i;
  const VF zero = hn::Zero(f);
  const VI none = hn::Zero(i);
  Layers l{zero, zero, zero, zero, zero, zero, zero, zero, none, none, none, none};
  // Steepest of the surfaces so far, in inverse depth per pixel.
  float steepest = 0;
  for (const Candidate& candidate : in.candidates) {
    // Closed in front of all that is left, with room for what meets it within a pixel: candidates
    // are sorted by their nearest possible point.
    const MF closed = hn::And(hn::Ge(l.c0, hn::Set(f, 1.0F)),
                              hn::Gt(l.q0, hn::Set(f, candidate.q_max + steepest)));
    steepest = std::max(steepest, candidate.slope);
    if (hn::AllTrue(f, closed)) break;
    const ProjectedPolygon& p = in.polygons[static_cast<std::size_t>(candidate.polygon)];
    const VF q = dot(p.q, x, y);
    VF c = candidate.covers ? hn::Set(f, 1.0F) : coverage(p, x, y);
    // Lane by lane, so that a pixel does not depend on its neighbours in the packet.
    const MF seen =
        hn::AndNot(closed, hn::And(hn::Gt(q, zero), hn::Gt(c, hn::Set(f, kNegligible))));
    if (hn::AllFalse(f, seen)) continue;
    c = hn::IfThenElseZero(seen, c);
    if (p.opacity >= 0) {
      c = hn::Mul(c, opacity(in, p, x, y, hn::Max(q, hn::Set(f, 1e-7F))));
      c = hn::IfThenElseZero(hn::Gt(c, hn::Set(f, 4 * kNegligible)), c);
    }
    // A lane with no coverage carries inverse depth zero and so sinks below every surface.
    insert(l, hn::IfThenElseZero(hn::Gt(c, zero), q), c, hn::Set(i, candidate.polygon));
  }
  return l;
}

/// Where two surfaces cut through each other, the pixel belongs to each on its side of the line of
/// equal depth: what the nearer one keeps of its coverage. The difference of inverse depths is
/// linear in the pixel, so its distance to that line is exact. Without it everything that stands on
/// the ground would have a jagged foot.
HWY_INLINE VF share_crossing(const TileInput& in, const Layers& l, MF close) {
  const F f;
  const I i;
  const VF one = hn::Set(f, 1.0F), zero = hn::Zero(f);
  constexpr std::int32_t kStride = sizeof(ProjectedPolygon) / sizeof(float),
                         kSlope = offsetof(ProjectedPolygon, q) / sizeof(float);
  const float* slopes = reinterpret_cast<const float*>(in.polygons.data());
  const VI a = hn::Add(hn::Mul(l.p0, hn::Set(i, kStride)), hn::Set(i, kSlope)),
           b = hn::Add(hn::Mul(l.p1, hn::Set(i, kStride)), hn::Set(i, kSlope));
  const VI next = hn::Set(i, 1);
  const VF dx = hn::Mul(hn::Sub(hn::GatherIndex(f, slopes, a), hn::GatherIndex(f, slopes, b)),
                        hn::Set(f, in.pixel_x));
  const VF dy = hn::Mul(hn::Sub(hn::GatherIndex(f, slopes, hn::Add(a, next)),
                                hn::GatherIndex(f, slopes, hn::Add(b, next))),
                        hn::Set(f, in.pixel_y));
  const VF per_pixel = hn::Max(hn::Sqrt(hn::MulAdd(dx, dx, hn::Mul(dy, dy))), hn::Set(f, 1e-12F));
  const VF side = inner_part(hn::Div(hn::Sub(l.q0, l.q1), per_pixel));
  const VF behind = hn::Min(l.c0, hn::Max(zero, hn::Sub(one, l.c1)));
  const VF shared = hn::MulAdd(side, hn::Sub(l.c0, behind), behind);
  return hn::IfThenElse(hn::And(close, hn::Gt(l.c1, zero)), shared, l.c0);
}

HWY_INLINE VF shade(const TileInput& in, const ProjectedPolygon& p, VF x, VF y, VF q,
                    VF gain_pattern_even, int row_parity) {
  const F f;
  const Footprint at = footprint(in, p, x, y, q);
  const VF texture =
      sample(in.texture_words, p.texture, p.log2_width, p.log2_height, at.u, at.v, at.lu, at.lv);
  const auto& gains = p.gain[static_cast<std::size_t>(row_parity)];
  const VF gain = hn::IfThenElse(hn::Gt(gain_pattern_even, hn::Zero(f)), hn::Set(f, gains[0]),
                                 hn::Set(f, gains[1]));
  const VF clear = hn::Div(hn::Set(f, 1.0F),
                           hn::MulAdd(at.distance, hn::Set(f, in.haze_per_m), hn::Set(f, 1.0F)));
  const VF haze = hn::Set(f, in.haze);
  return hn::MulAdd(clear, hn::Sub(hn::Mul(texture, gain), haze), haze);
}

void ShadeTile(const TileInput& in, float weight, float* out, std::ptrdiff_t out_stride) {
  const F f;
  const I i;
  const std::size_t n = hn::Lanes(f);
  HWY_ALIGN std::int32_t ids[kTile];
  const VF even = hn::ConvertTo(f, hn::Sub(hn::Set(i, 1), hn::And(hn::Iota(i, 0), hn::Set(i, 1))));
  for (std::size_t row = 0; row < kTile; ++row)
    for (std::size_t column = 0; column < kTile; column += n) {
      const VF x = hn::LoadU(f, in.ray_x + row * kTile + column),
               y = hn::LoadU(f, in.ray_y + row * kTile + column);
      Layers l = find_layers(in, x, y);
      // Surfaces that meet within a pixel are not far apart in depth.
      const MF close = hn::Gt(l.q1, hn::Mul(hn::Set(f, 0.5F), l.q0));
      if (!hn::AllFalse(f, close)) l.c0 = share_crossing(in, l, close);
      VF sum = hn::Zero(f), covered = hn::Zero(f);
      const auto add = [&](VF q, VF c, VI p) HWY_ATTR {
        // Coverage adds up to one: surfaces that share an edge close the pixel between them, and
        // whatever is behind an edge fills the rest.
        const VF w = hn::Min(c, hn::Sub(hn::Set(f, 1.0F), covered));
        auto open = hn::Gt(w, hn::Set(f, kNegligible));
        if (hn::AllFalse(f, open)) return;
        covered = hn::Add(covered, w);
        hn::Store(p, i, ids);
        // Each turn handles one polygon, so there is at most one turn per lane.
        for (std::size_t turn = 0; turn < n; ++turn) {
          const std::intptr_t lane = hn::FindFirstTrue(f, open);
          if (lane < 0) break;
          const std::int32_t id = ids[lane];
          const auto mine = hn::And(open, hn::RebindMask(f, hn::Eq(p, hn::Set(i, id))));
          const VF value = shade(in, in.polygons[static_cast<std::size_t>(id)], x, y,
                                 hn::Max(q, hn::Set(f, 1e-7F)), even, static_cast<int>(row & 1U));
          sum = hn::Add(sum, hn::IfThenElseZero(mine, hn::Mul(w, value)));
          open = hn::AndNot(mine, open);
        }
      };
      add(l.q0, l.c0, l.p0);
      if (!hn::AllTrue(f, hn::Ge(covered, hn::Set(f, 1.0F)))) {
        add(l.q1, l.c1, l.p1);
        add(l.q2, l.c2, l.p2);
        add(l.q3, l.c3, l.p3);
      }
      // The part left uncovered by more than kLayers surfaces looks like the covered part; nothing
      // at all is haze without end.
      const VF trace = hn::Set(f, 1e-3F);
      sum = hn::Div(hn::MulAdd(trace, hn::Set(f, in.haze), sum), hn::Add(covered, trace));
      float* at = out + static_cast<std::ptrdiff_t>(row) * out_stride + column;
      hn::StoreU(hn::MulAdd(sum, hn::Set(f, weight), hn::LoadU(f, at)), f, at);
    }
}

/// Integer hash with good avalanche in every byte (two rounds of multiply and xor-shift).
HWY_INLINE hn::Vec<U> hash(hn::Vec<U> x) {
  const U u;
  x = hn::Xor(x, hn::ShiftRight<16>(x));
  x = hn::Mul(x, hn::Set(u, 0x7feb352dU));
  x = hn::Xor(x, hn::ShiftRight<15>(x));
  x = hn::Mul(x, hn::Set(u, 0x846ca68bU));
  return hn::Xor(x, hn::ShiftRight<16>(x));
}

void ExposeTile(const SensorInput& in, const float* brightness, std::ptrdiff_t brightness_stride,
                std::uint32_t first_pixel, int columns, int rows, std::uint8_t* out,
                std::ptrdiff_t out_stride) {
  const F f;
  const I i;
  const U u;
  const std::size_t n = hn::Lanes(f);
  HWY_ALIGN std::int32_t pixels[kTile];
  for (int row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < kTile; column += n) {
      const std::size_t k = static_cast<std::size_t>(row) * kTile + column;
      const VF x = hn::LoadU(f, in.ray_x + k), y = hn::LoadU(f, in.ray_y + k);
      const VF r2 = hn::MulAdd(x, x, hn::Mul(y, y));
      const VF falloff =
          hn::Div(hn::Set(f, 1.0F), hn::MulAdd(hn::Set(f, in.vignetting), r2, hn::Set(f, 1.0F)));
      VF value = hn::Mul(hn::LoadU(f, brightness + row * brightness_stride + column),
                         hn::Set(f, in.exposure));
      value = hn::Mul(value, hn::Mul(falloff, falloff));
      if (in.noise_scale > 0) {
        // Sum of a hash's four bytes: mean 510, variance 4 (256² − 1)/12 = 147.8²; near enough to
        // normal to 3 sigma.
        auto h = hash(hn::Xor(hn::Add(hn::Iota(u, first_pixel + static_cast<std::uint32_t>(k)),
                                      hn::Set(u, in.seed * 0x9e3779b9U)),
                              hn::Set(u, in.seed)));
        const auto pair = hn::Set(u, 0x00ff00ffU);
        h = hn::Add(hn::And(h, pair), hn::And(hn::ShiftRight<8>(h), pair));
        h = hn::Add(hn::And(h, hn::Set(u, 0xffffU)), hn::ShiftRight<16>(h));
        const VF normal = hn::Mul(hn::Sub(hn::ConvertTo(f, hn::BitCast(i, h)), hn::Set(f, 510.0F)),
                                  hn::Set(f, in.noise_scale / 147.8F));
        const VF sigma = hn::Sqrt(hn::MulAdd(hn::Max(value, hn::Zero(f)), hn::Set(f, in.shot),
                                             hn::Set(f, in.read_variance)));
        value = hn::MulAdd(sigma, normal, value);
      }
      value = hn::Min(hn::Max(value, hn::Zero(f)), hn::Set(f, 255.0F));
      hn::Store(hn::NearestInt(value), i, pixels + column);
    }
    for (int column = 0; column < columns; ++column)
      out[row * out_stride + column] = static_cast<std::uint8_t>(pixels[column]);
  }
}

}  // namespace vergence::mock::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::mock {

HWY_EXPORT(ShadeTile);
HWY_EXPORT(ExposeTile);

void shade_tile(const TileInput& in, float weight, float* out, std::ptrdiff_t out_stride) noexcept {
  HWY_DYNAMIC_DISPATCH(ShadeTile)(in, weight, out, out_stride);
}

void expose_tile(const SensorInput& in, const float* brightness, std::ptrdiff_t brightness_stride,
                 std::uint32_t first_pixel, int columns, int rows, std::uint8_t* out,
                 std::ptrdiff_t out_stride) noexcept {
  HWY_DYNAMIC_DISPATCH(ExposeTile)
  (in, brightness, brightness_stride, first_pixel, columns, rows, out, out_stride);
}

}  // namespace vergence::mock
#endif
