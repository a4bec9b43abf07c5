#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "app/datasets/image_file.hpp"

struct libdeflate_decompressor;

namespace vergence::app::detail {

/// The PNGs that data sets are made of, 8-bit grey and not interlaced, by libdeflate, which
/// inflates in less than half of zlib's time; libpng cannot be given another inflater.
///
/// Source   W3C PNG (second edition): §9.2 filter types, §9.4 Paeth
/// Threads  One caller. Memory: reserve()'s; decode() takes no heap. Errors: the constructor and
///          reserve() throw std::bad_alloc.
class GreyPngDecoder {
 public:
  GreyPngDecoder();
  ~GreyPngDecoder();
  GreyPngDecoder(const GreyPngDecoder&) = delete;
  GreyPngDecoder& operator=(const GreyPngDecoder&) = delete;

  /// For files of so many bytes and images of that size, and such with less of both.
  void reserve(std::size_t file_bytes, ImageSize size);
  /// False for any other PNG and for such with anything wrong inside: libpng decides about those;
  /// and for one that is larger than what was reserved. `out` is undefined then.
  /// Precondition: check_png() is right.
  [[nodiscard]] bool decode(std::span<const std::uint8_t> bytes, ImageSize size, std::uint8_t* out,
                            std::size_t stride) noexcept;

 private:
  struct Release {
    void operator()(libdeflate_decompressor* d) const noexcept;
  };
  std::unique_ptr<std::uint8_t[]> work_;
  std::size_t work_size_ = 0;
  std::unique_ptr<libdeflate_decompressor, Release> inflater_;
};

/// The same for once. No memory is as any other failure. Throws nothing.
[[nodiscard]] bool decode_grey_png(std::span<const std::uint8_t> bytes, ImageSize size,
                                   std::uint8_t* out, std::size_t stride) noexcept;

}  // namespace vergence::app::detail
