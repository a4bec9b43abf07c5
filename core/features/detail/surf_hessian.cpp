#include "core/features/detail/surf_hessian.hpp"

namespace vergence::features::detail {
namespace {

/// Rows of the integral image at the edges of the boxes for one row of centres, and the distances
/// of their columns from a centre.
struct Boxes {
  Boxes(const IntegralImage& image, int y, int L) noexcept
      : lobe(L / 3),
        half(L / 2),
        middle(lobe / 2),
        xx{image.row(y - lobe + 1), image.row(y + lobe)},
        yy{image.row(y - half), image.row(y - middle), image.row(y + middle + 1),
           image.row(y + half + 1)},
        xy{image.row(y - lobe), image.row(y), image.row(y + 1), image.row(y + lobe + 1)},
        weight(1.F / static_cast<float>(L * L)) {}

  [[nodiscard]] BoxHessian at(int x) const noexcept {
    const auto stereo = [](const std::uint32_t* row, int from, int to) noexcept {
      return row[to] - row[from];
    };
    // Compute modulo 2³² until the end; the sums of boxes and their small multiples fit into 32
    // signed bits.
    const int a = x - half, b = x - middle, c = x + middle + 1, d = x + half + 1;
    const std::uint32_t dxx = stereo(xx[1], a, d) - stereo(xx[0], a, d) -
                              3U * (stereo(xx[1], b, c) - stereo(xx[0], b, c));
    const int e = x - lobe + 1, f = x + lobe;
    const std::uint32_t dyy = stereo(yy[3], e, f) - stereo(yy[0], e, f) -
                              3U * (stereo(yy[2], e, f) - stereo(yy[1], e, f));
    const int p = x - lobe, q = x + lobe + 1;
    const std::uint32_t dxy = stereo(xy[1], p, x) - stereo(xy[0], p, x) + stereo(xy[3], x + 1, q) -
                              stereo(xy[2], x + 1, q) -
                              (stereo(xy[1], x + 1, q) - stereo(xy[0], x + 1, q)) -
                              (stereo(xy[3], p, x) - stereo(xy[2], p, x));
    const auto scaled = [this](std::uint32_t sum) noexcept {
      return weight * static_cast<float>(static_cast<std::int32_t>(sum));
    };
    return {scaled(dxx), scaled(dyy), scaled(dxy)};
  }

  int lobe, half, middle;
  const std::uint32_t* xx[2];
  const std::uint32_t* yy[4];
  const std::uint32_t* xy[4];
  float weight;
};

}  // namespace

BoxHessian box_hessian(const IntegralImage& image, int x, int y, int L) noexcept {
  return Boxes(image, y, L).at(x);
}

void determinant_row(const IntegralImage& image, int x, int y, int L, int step, int n,
                     float* out) noexcept {
  const Boxes boxes(image, y, L);
  // Neighbouring positions are loaded as vectors; a separate loop lets the compiler do so.
  if (step == 1) {
    for (int i = 0; i < n; ++i) out[i] = boxes.at(x + i).determinant();
  } else {
    for (int i = 0; i < n; ++i) out[i] = boxes.at(x + i * step).determinant();
  }
}

}  // namespace vergence::features::detail
