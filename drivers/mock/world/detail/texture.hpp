#pragma once
#include <cstdint>
#include <vector>

namespace vergence::mock {

/// Periodic grey texture under construction: brightness 0 to 1 over a rectangle in metres, row 0 at
/// v = 0 (bottom).
class Canvas {
 public:
  /// The size in texels is 2^log2_width by 2^log2_height.
  Canvas(int log2_width, int log2_height, double width_m, double height_m, float value);

  [[nodiscard]] int width() const noexcept { return 1 << log2_width_; }
  [[nodiscard]] int height() const noexcept { return 1 << log2_height_; }
  [[nodiscard]] int log2_width() const noexcept { return log2_width_; }
  [[nodiscard]] int log2_height() const noexcept { return log2_height_; }
  [[nodiscard]] double width_m() const noexcept { return width_m_; }
  [[nodiscard]] double height_m() const noexcept { return height_m_; }
  [[nodiscard]] float& at(int x, int y) noexcept {
    return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width()) +
                   static_cast<std::size_t>(x)];
  }
  [[nodiscard]] const std::vector<float>& texels() const noexcept { return texels_; }

  /// Blends `value` over [u0, u1] x [v0, v1] (m) with exact area coverage at the border texels;
  /// wraps around the edges.
  void rectangle(double u0, double v0, double u1, double v1, float value, float opacity = 1.0F);
  /// Disc texture; the border is one texel wide.
  void disc(double u, double v, double radius_m, float value, float opacity = 1.0F);
  /// Draws a straight stroke of the given width.
  void stroke(double u0, double v0, double u1, double v1, double width_m, float value,
              float opacity = 1.0F);

  /// Adds periodic value noise of one band with a lattice of about `cell_m`, uniform in ±amplitude.
  /// Cells below three texels are widened to three, to stay below the Nyquist frequency.
  void noise(double cell_u_m, double cell_v_m, float amplitude, std::uint64_t seed);
  /// Adds octaves of noise() from `coarsest_m` down by halves, each with `falloff` times the
  /// strength of the previous.
  void octaves(double coarsest_m, int count, float amplitude, float falloff, std::uint64_t seed);
  void clamp(float lo, float hi);

 private:
  void blend(int x, int y, float value, float opacity) noexcept;

  int log2_width_, log2_height_;
  double width_m_, height_m_;
  std::vector<float> texels_;
};

/// Position of a texture in the atlas.
struct TextureRef {
  /// Index of the first word; negative: none.
  std::int32_t base = -1;
  std::int32_t log2_width = 0;
  std::int32_t log2_height = 0;
};

/// All textures of a world in one array, prefiltered per axis (rip-maps: level (i, j) is halved i
/// times along u and j times along v), because one level for both axes would blur streets seen at
/// grazing angles.
///
/// Layout  A texture of w x h texels takes 2w x 2h words, rows of 2w; level (i, j) starts at x = 2w
///         - (2w >> i), y = 2h - (2h >> j). One word holds the texel and its right, upper and upper
///         right neighbours (bits 0, 8, 16, 24), so that one 32-bit gather fetches everything a
///         bilinear look-up needs. All levels wrap around.
class TextureAtlas {
 public:
  TextureRef add(const Canvas& canvas);
  [[nodiscard]] const std::int32_t* words() const noexcept { return words_.data(); }
  [[nodiscard]] std::size_t size() const noexcept { return words_.size(); }

 private:
  std::vector<std::int32_t> words_;
};

}  // namespace vergence::mock
