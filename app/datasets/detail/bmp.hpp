#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "app/datasets/image_file.hpp"

/// Uncompressed BMP of 8 bits (a palette of greys, or none) or 24 bits. Files are untrusted: every
/// offset is checked against the bytes there are.
namespace vergence::app::detail {

inline constexpr std::size_t kBmpHead = 26;  // bytes up to the end of the size

[[nodiscard]] bool is_bmp(std::span<const std::uint8_t> bytes) noexcept;

/// From the head alone. Precondition: is_bmp(). → ok, torn, not_an_image
[[nodiscard]] ImageFileStatus bmp_size(std::span<const std::uint8_t> bytes,
                                       ImageSize* size) noexcept;

/// Whether every row is there. Precondition: is_bmp(). → ok, torn, not_an_image
[[nodiscard]] ImageFileStatus check_bmp(std::span<const std::uint8_t> bytes) noexcept;

/// Rows of `stride` bytes. Precondition: check_bmp() and the size are right. → ok, undecodable
/// (other depths, compressed, a palette of colours)
[[nodiscard]] ImageFileStatus decode_bmp(std::span<const std::uint8_t> bytes, ImageSize size,
                                         std::uint8_t* out, std::size_t stride) noexcept;

}  // namespace vergence::app::detail
