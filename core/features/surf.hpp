#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/features/detail/surf_integral.hpp"
#include "core/features/mask.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/image.hpp"

namespace vergence::features {

/// A blob with its size.
struct SurfPoint {
  /// Sub-pixel position; pixel centres are at integer coordinates.
  float x = 0, y = 0;
  /// Scale s in px: sigma of the Gaussian whose second derivatives fit best.
  float scale = 0;
  /// Determinant of the box Hessian, in grey levels².
  float response = 0;
  /// Sign of the Laplacian: true if dark on a bright background.
  bool dark = false;
};

/// SURF-64 descriptor of unit length; all zero without structure or at the edge of the image.
struct SurfDescriptor {
  alignas(16) std::array<float, 64> values{};
};

struct SurfOptions {
  /// Minimum response, in grey levels².
  float min_response = 4;
  /// Mask of the image; may be null.
  const Mask* mask = nullptr;
};

enum class SurfStatus : std::uint8_t {
  ok,
  /// The image is empty, or its rows overlap.
  invalid_image,
  /// The image exceeds the size given to the constructor.
  too_large,
};

/// Speeded-up robust features: detects blobs by the determinant of a box Hessian and describes them
/// by sums of Haar wavelets, upright: for cameras that roll less than about 15°.
///
/// Source     Bay, Ess, Tuytelaars, Van Gool, "Speeded-Up Robust Features", CVIU 110 (2008). Boxes
///            of 3 (k 2^o + 1) px in octave o = 1, 2, 3 with k = 1 … 4, sampled every 2^(o−1) px;
///            maxima of the two inner sizes. They are refined by one parabola in x and y and one in
///            size; the paper's joint one is biased by up to a tenth of a step.
/// Ownership  Only sums over the image are kept. The caller owns points and descriptors.
/// Threads    set_image() and detect() by one thread; describe() is const.
/// Memory     From the arena at construction: 4 bytes per pixel and twelve rows. If the output is
///            full, the weakest points are dropped.
/// Time       O(pixels · octaves) to detect, O(1) per point to describe.
/// Errors     Nothing throws after construction. Without a valid image there are no points and
///            descriptors are zero.
class Surf {
 public:
  Surf() noexcept = default;
  Surf(int max_width, int max_height, Arena& arena);

  /// Sets the image. If the result is not `ok`, there is no image.
  [[nodiscard]] SurfStatus set_image(const ImageView& image) noexcept;

  /// Detects the points of the image, strongest first. Returns their number, which exceeds
  /// out->size() if some did not fit.
  int detect(const SurfOptions& options, BoundedVector<SurfPoint>* out) noexcept;

  /// Precondition: as many descriptors as points.
  void describe(std::span<const SurfPoint> points, std::span<SurfDescriptor> out) const noexcept;

 private:
  // Number of octaves: scales up to 3, 6 and 12 px.
  static constexpr int kOctaves = 3;
  // Number of sizes per octave.
  static constexpr int kLayers = 4;
  // Number of neighbouring rows of each size.
  static constexpr int kRows = 3;

  struct Octave;
  int scan_octave(const Octave& octave, const SurfOptions& options,
                  BoundedVector<SurfPoint>* out) noexcept;
  [[nodiscard]] bool refine(const Octave& octave, int layer, int column, int row,
                            SurfPoint* p) const noexcept;
  [[nodiscard]] bool greatest(int layer, int column, int row) const noexcept;
  [[nodiscard]] float* responses(int layer, int row) noexcept {
    return rows_.data() + offset(layer, row);
  }
  [[nodiscard]] const float* responses(int layer, int row) const noexcept {
    return rows_.data() + offset(layer, row);
  }
  [[nodiscard]] std::size_t offset(int layer, int row) const noexcept {
    return static_cast<std::size_t>(row % kRows * kLayers + layer) *
           static_cast<std::size_t>(max_width_);
  }

  int max_width_ = 0, max_height_ = 0;
  detail::IntegralImage sums_;
  // Ring of three rows of responses for each of kLayers sizes.
  std::span<float> rows_;
};

}  // namespace vergence::features
