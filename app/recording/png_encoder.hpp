#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/types/image.hpp"

struct libdeflate_compressor;

namespace vergence::app {

/// 8-bit grey images as PNG, quickly rather than small, in fixed memory.
///
///     PngEncoder encoder(752, 480);
///     std::vector<std::uint8_t> file(PngEncoder::most_bytes(752, 480));
///     file.resize(encoder.encode(image, file));
///
/// Source   W3C PNG (second edition), §5 chunks, §9 the filter Sub; deflate by libdeflate, which
///          takes half of zlib's time and, unlike libpng, no heap once it is made.
/// Threads  One caller. Memory: all at construction, the image's size and libdeflate's. Errors: the
///          constructor throws std::bad_alloc.
class PngEncoder {
 public:
  /// Images of at most so many pixels.
  PngEncoder(int width, int height);
  ~PngEncoder();
  PngEncoder(const PngEncoder&) = delete;
  PngEncoder& operator=(const PngEncoder&) = delete;

  /// That no image of this size takes more than.
  [[nodiscard]] static std::size_t most_bytes(int width, int height) noexcept;
  /// → bytes of the file; 0: the image is larger than those of the constructor, or `out` is too
  /// small
  [[nodiscard]] std::size_t encode(const ImageView& image, std::span<std::uint8_t> out) noexcept;

 private:
  struct Release {
    void operator()(libdeflate_compressor* c) const noexcept;
  };
  std::vector<std::uint8_t> filtered_;  // rows with their filter before them
  std::unique_ptr<libdeflate_compressor, Release> deflate_;
};

}  // namespace vergence::app
