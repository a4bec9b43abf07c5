#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "app/datasets/image_file.hpp"

namespace vergence::app::detail {

/// The PNGs that data sets are made of, 8-bit grey and not interlaced, by libdeflate, which
/// inflates in less than half of zlib's time; libpng cannot be given another inflater.
///
/// Source    W3C PNG (second edition): §9.2 filter types, §9.4 Paeth
/// Returns   false for any other PNG and for such with anything wrong inside: libpng decides about
///           those. `out` is undefined then.
/// Precondition: check_png() and the size are right. Throws nothing.
[[nodiscard]] bool decode_grey_png(std::span<const std::uint8_t> bytes, ImageSize size,
                                   std::uint8_t* out, std::size_t stride) noexcept;

}  // namespace vergence::app::detail
