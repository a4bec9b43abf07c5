#include "drivers/mock/world/detail/texture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/math/random.hpp"

namespace vergence::mock {
namespace {

int wrapped(int i, int n) noexcept { return ((i % n) + n) % n; }

/// Overlap of texel [i, i + 1] with [a, b].
float overlap(int i, double a, double b) noexcept {
  return static_cast<float>(
      std::clamp(std::min(b, i + 1.0) - std::max(a, static_cast<double>(i)), 0.0, 1.0));
}

/// Halves one axis with the binomial-like taps 1 3 3 1: flatter than a box below the new Nyquist
/// frequency, no overshoot.
std::vector<float> halve(const std::vector<float>& in, int width, int height, bool along_u) {
  const int w = along_u ? width / 2 : width, h = along_u ? height : height / 2;
  std::vector<float> out(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  const auto at = [&](int x, int y) {
    return in[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
              static_cast<std::size_t>(x)];
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      float v = 0;
      if (along_u) {
        const int a = wrapped(2 * x - 1, width), d = wrapped(2 * x + 2, width);
        v = 0.125F * (at(a, y) + at(d, y)) + 0.375F * (at(2 * x, y) + at(2 * x + 1, y));
      } else {
        const int a = wrapped(2 * y - 1, height), d = wrapped(2 * y + 2, height);
        v = 0.125F * (at(x, a) + at(x, d)) + 0.375F * (at(x, 2 * y) + at(x, 2 * y + 1));
      }
      out[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] =
          v;
    }
  return out;
}

/// Writes one level: every word with its 2x2 neighbourhood.
void pack(const std::vector<float>& level, int width, int height, std::int32_t* at, int row_words) {
  std::vector<std::uint32_t> bytes(level.size());
  for (std::size_t i = 0; i < level.size(); ++i)
    bytes[i] = static_cast<std::uint32_t>(std::lround(255.0F * std::clamp(level[i], 0.0F, 1.0F)));
  for (int y = 0; y < height; ++y) {
    const std::uint32_t* r0 = bytes.data() + static_cast<std::ptrdiff_t>(y) * width;
    const std::uint32_t* r1 = bytes.data() + static_cast<std::ptrdiff_t>((y + 1) % height) * width;
    std::int32_t* out = at + static_cast<std::ptrdiff_t>(y) * row_words;
    for (int x = 0; x < width; ++x) {
      const int n = x + 1 == width ? 0 : x + 1;
      out[x] = static_cast<std::int32_t>(r0[x] | (r0[n] << 8U) | (r1[x] << 16U) | (r1[n] << 24U));
    }
  }
}

}  // namespace

Canvas::Canvas(int log2_width, int log2_height, double width_m, double height_m, float value)
    : log2_width_(log2_width),
      log2_height_(log2_height),
      width_m_(width_m),
      height_m_(height_m),
      texels_(std::size_t{1} << static_cast<unsigned>(log2_width + log2_height), value) {}

void Canvas::blend(int x, int y, float value, float opacity) noexcept {
  float& t = at(x & (width() - 1), y & (height() - 1));
  t += opacity * (value - t);
}

void Canvas::rectangle(double u0, double v0, double u1, double v1, float value, float opacity) {
  const double su = width() / width_m_, sv = height() / height_m_;
  const double x0 = u0 * su, x1 = u1 * su, y0 = v0 * sv, y1 = v1 * sv;
  for (int y = static_cast<int>(std::floor(y0)); y < y1; ++y)
    for (int x = static_cast<int>(std::floor(x0)); x < x1; ++x)
      blend(x, y, value, opacity * overlap(x, x0, x1) * overlap(y, y0, y1));
}

void Canvas::disc(double u, double v, double radius_m, float value, float opacity) {
  const double su = width() / width_m_, sv = height() / height_m_, texel = 1.0 / std::min(su, sv);
  for (int y = static_cast<int>(std::floor((v - radius_m - texel) * sv));
       y <= (v + radius_m + texel) * sv; ++y)
    for (int x = static_cast<int>(std::floor((u - radius_m - texel) * su));
         x <= (u + radius_m + texel) * su; ++x) {
      const double r = std::hypot((x + 0.5) / su - u, (y + 0.5) / sv - v);
      blend(x, y, value,
            opacity * static_cast<float>(std::clamp((radius_m - r) / texel + 0.5, 0.0, 1.0)));
    }
}

void Canvas::stroke(double u0, double v0, double u1, double v1, double width, float value,
                    float opacity) {
  const double su = width_m_ > 0 ? this->width() / width_m_ : 1.0, sv = height() / height_m_,
               texel = 1.0 / std::min(su, sv);
  const double du = u1 - u0, dv = v1 - v0, length2 = std::max(du * du + dv * dv, 1e-12),
               margin = 0.5 * width + texel;
  for (int y = static_cast<int>(std::floor((std::min(v0, v1) - margin) * sv));
       y <= (std::max(v0, v1) + margin) * sv; ++y)
    for (int x = static_cast<int>(std::floor((std::min(u0, u1) - margin) * su));
         x <= (std::max(u0, u1) + margin) * su; ++x) {
      const double pu = (x + 0.5) / su - u0, pv = (y + 0.5) / sv - v0;
      const double s = std::clamp((pu * du + pv * dv) / length2, 0.0, 1.0);
      const double r = std::hypot(pu - s * du, pv - s * dv);
      blend(x, y, value,
            opacity * static_cast<float>(std::clamp((0.5 * width - r) / texel + 0.5, 0.0, 1.0)));
    }
}

void Canvas::noise(double cell_u_m, double cell_v_m, float amplitude, std::uint64_t seed) {
  const int nu =
      std::clamp(static_cast<int>(std::lround(width_m_ / cell_u_m)), 1, std::max(1, width() / 3));
  const int nv =
      std::clamp(static_cast<int>(std::lround(height_m_ / cell_v_m)), 1, std::max(1, height() / 3));
  std::vector<float> lattice(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv));
  Random random(seed, 77);
  for (float& l : lattice) l = amplitude * static_cast<float>(random.uniform(-1, 1));
  const auto smooth = [](float s) { return s * s * s * (s * (6.0F * s - 15.0F) + 10.0F); };
  struct Tap {
    std::size_t a, b;
    float s;
  };
  const auto taps = [&](int n, int cells) {
    std::vector<Tap> t(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      const float at =
          (static_cast<float>(i) + 0.5F) * static_cast<float>(cells) / static_cast<float>(n);
      const int c = std::min(static_cast<int>(at), cells - 1);
      t[static_cast<std::size_t>(i)] = {static_cast<std::size_t>(c),
                                        static_cast<std::size_t>((c + 1) % cells),
                                        smooth(at - static_cast<float>(c))};
    }
    return t;
  };
  const auto tu = taps(width(), nu), tv = taps(height(), nv);
  for (int y = 0; y < height(); ++y) {
    const Tap& v = tv[static_cast<std::size_t>(y)];
    const float* r0 = lattice.data() + v.a * static_cast<std::size_t>(nu);
    const float* r1 = lattice.data() + v.b * static_cast<std::size_t>(nu);
    for (int x = 0; x < width(); ++x) {
      const Tap& u = tu[static_cast<std::size_t>(x)];
      const float p = r0[u.a] + u.s * (r0[u.b] - r0[u.a]), q = r1[u.a] + u.s * (r1[u.b] - r1[u.a]);
      at(x, y) += p + v.s * (q - p);
    }
  }
}

void Canvas::octaves(double coarsest_m, int count, float amplitude, float falloff,
                     std::uint64_t seed) {
  double cell = coarsest_m;
  for (int i = 0; i < count; ++i, cell *= 0.5, amplitude *= falloff)
    noise(cell, cell, amplitude, seed + static_cast<std::uint64_t>(i) * 1013U);
}

void Canvas::clamp(float lo, float hi) {
  for (float& t : texels_) t = std::clamp(t, lo, hi);
}

TextureRef TextureAtlas::add(const Canvas& canvas) {
  const int w = canvas.width(), h = canvas.height();
  const std::size_t words = 4U * static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
  if (words_.size() + words > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    throw std::length_error("the world's textures do not fit 31-bit indices");
  const TextureRef ref{static_cast<std::int32_t>(words_.size()), canvas.log2_width(),
                       canvas.log2_height()};
  words_.resize(words_.size() + words);
  std::int32_t* base = words_.data() + ref.base;
  // Level (0, j).
  std::vector<float> row = canvas.texels();
  for (int j = 0; j <= ref.log2_height; ++j) {
    // Level (i, j).
    std::vector<float> level = row;
    for (int i = 0; i <= ref.log2_width; ++i) {
      const std::ptrdiff_t x0 = 2 * w - ((2 * w) >> i), y0 = 2 * h - ((2 * h) >> j);
      pack(level, w >> i, h >> j, base + y0 * 2 * w + x0, 2 * w);
      if (i < ref.log2_width) level = halve(level, w >> i, h >> j, true);
    }
    if (j < ref.log2_height) row = halve(row, w, h >> j, false);
  }
  return ref;
}

}  // namespace vergence::mock
