#pragma once
#include <cstddef>
#include <cstdint>

#include "core/types/image.hpp"

namespace vergence::features::detail {

/// Number of entries of the row buffer that downsample() needs for a source of this width.
[[nodiscard]] std::size_t filtered_row_length(int width) noexcept;

/// Makes a pyramid level of half the size; `to` has its size and stride, `out` its bytes. The
/// widest vectors of the machine are selected at run time, with the same bits on every target.
void downsample(const ImageView& from, std::uint8_t* out, const ImageView& to,
                std::uint16_t* row) noexcept;

}  // namespace vergence::features::detail
