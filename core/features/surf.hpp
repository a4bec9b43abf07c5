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

/// A blob, its size and direction.
struct SurfPoint {
  float x = 0, y = 0;  // px, sub-pixel; pixel centres at whole numbers
  float scale = 0;     // s, px: sigma of the Gaussian whose second derivatives fit best
  float angle = 0;     // rad, x towards y; 0 when upright
  float response = 0;  // determinant of the box Hessian, grey levels²
  bool dark = false;   // sign of the Laplacian: dark on a bright ground
};

/// SURF-64, of unit length; all zero where the picture is flat or the point lies at its edge.
struct SurfDescriptor {
  alignas(16) std::array<float, 64> values{};
};

inline constexpr int kMaxSurfOctaves = 4;

struct SurfOptions {
  int octaves = 3;             // 1 … kMaxSurfOctaves: scales up to 3, 6, 12, 24 px
  float min_response = 4;      // grey levels²
  const Mask* mask = nullptr;  // of the image; null: all of it is looked at
};

enum class SurfStatus : std::uint8_t {
  ok,
  invalid_image,  // empty, or rows overlap
  too_large,      // larger than given to the constructor
};

/// Speeded-up robust features: blobs by the determinant of a Hessian of boxes, sums of Haar
/// wavelets as their description.
///
/// Source     Bay, Ess, Tuytelaars, Van Gool, "Speeded-Up Robust Features", CVIU 110 (2008). Boxes
///            of 3 (k 2^o + 1) px in octave o = 1, 2, … with k = 1 … 4, sampled every 2^(o−1) px;
///            maxima of the two inner sizes, refined by a parabola in x and y and one in size: the
///            joint one of the paper leans where size and place of the top both lie between
///            samples, by up to a tenth of a step.
/// Ownership  Nothing of the image is kept but sums over it. The caller owns points and
///            descriptors.
/// Threads    set_image() and detect() by one thread; describe() is const.
/// Memory     From the arena at construction: 4 bytes a pixel and twelve rows. Points that find no
///            room are dropped, weakest first.
/// Time       O(pixels · octaves) to detect, O(1) a point to describe; no bound on pixels but the
///            constructor's.
/// Errors     Nothing throws after construction. Without a valid image there are no points and
///            descriptors are zero.
class Surf {
 public:
  Surf() noexcept = default;
  /// Images of at most this size. Throws std::length_error when the arena is full.
  Surf(int max_width, int max_height, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(int max_width, int max_height) noexcept;

  /// Not `ok`: there is no image any more.
  [[nodiscard]] SurfStatus set_image(const ImageView& image) noexcept;

  /// Points of the image, strongest first, upright. Returns how many there are: more than
  /// out->size() when some found no room.
  int detect(const SurfOptions& options, BoundedVector<SurfPoint>* out) noexcept;

  /// Gives each point the direction of its neighbourhood. Without it they stay upright: more
  /// distinct and faster, for cameras that roll less than some 15°.
  void orient(std::span<SurfPoint> points) const noexcept;

  /// Precondition: as many descriptors as points.
  void describe(std::span<const SurfPoint> points, std::span<SurfDescriptor> out) const noexcept;

 private:
  static constexpr int kLayers = 4;  // sizes an octave
  static constexpr int kRows = 3;    // neighbouring rows of each

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
  std::span<float> rows_;  // ring of three rows of places, each of kLayers sizes
};

}  // namespace vergence::features
