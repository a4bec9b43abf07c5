#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "app/datasets/image_file.hpp"

/// JPEG by libjpeg-turbo. Files are hostile: the size is accepted before the decoder sees a byte,
/// and what it would only warn of is torn.
namespace vergence::app::detail {

/// A JPEG's size stands behind its metadata: four segments of 64 KiB.
inline constexpr std::size_t kJpegHead = std::size_t{256} << 10;  // bytes

[[nodiscard]] bool is_jpeg(std::span<const std::uint8_t> bytes) noexcept;

/// From the head alone. Precondition: is_jpeg(). → ok, torn, not_an_image
[[nodiscard]] ImageFileStatus jpeg_size(std::span<const std::uint8_t> bytes,
                                        ImageSize* size) noexcept;

/// The end marker, followed by nothing but the zeros that some cameras fill up with. Precondition:
/// is_jpeg(). → ok, torn
[[nodiscard]] ImageFileStatus check_jpeg(std::span<const std::uint8_t> bytes) noexcept;

/// Rows of `stride` bytes: the file's own luminance where it has one (grey, YCbCr), RGB as 0.299 R
/// + 0.587 G + 0.114 B.
/// Precondition: check_jpeg() and the size are right. Throws nothing. → ok, torn (damaged inside),
/// undecodable (four colours, 12 bits, lossless, more scans than a camera writes)
[[nodiscard]] ImageFileStatus decode_jpeg(std::span<const std::uint8_t> bytes, ImageSize size,
                                          std::uint8_t* out, std::size_t stride) noexcept;

}  // namespace vergence::app::detail
