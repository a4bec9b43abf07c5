#pragma once
#include <cstddef>
#include <cstdint>

#include "core/types/image.hpp"

namespace vergence::features::detail {

/// Entries of the row buffer that downsample() needs for a source of this width.
[[nodiscard]] std::size_t filtered_row_length(int width) noexcept;

/// One pyramid step: `to` gives size and stride of the half image, whose bytes are at `out`.
/// Chosen at run time for the machine's widest vectors; every target gives the same bits.
void downsample(const ImageView& from, std::uint8_t* out, const ImageView& to,
                std::uint16_t* row) noexcept;

}  // namespace vergence::features::detail
