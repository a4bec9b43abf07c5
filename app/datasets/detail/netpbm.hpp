#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "app/datasets/image_file.hpp"

/// PGM and PPM of bytes (P5, P6), 8 or 16 bits a sample, as machine vision programs write them.
namespace vergence::app::detail {

inline constexpr std::size_t kNetpbmHead =
    4096;  // bytes in which the header ends, comments included

[[nodiscard]] bool is_netpbm(std::span<const std::uint8_t> bytes) noexcept;
/// → ok, not_an_image, torn (the header ends too early)
[[nodiscard]] ImageFileStatus netpbm_size(std::span<const std::uint8_t> head,
                                          ImageSize* size) noexcept;
/// → ok, not_an_image, torn
[[nodiscard]] ImageFileStatus check_netpbm(std::span<const std::uint8_t> bytes) noexcept;
/// The greatest sample of a grey one of 16 bits; nothing: another kind. Precondition:
/// check_netpbm() is ok.
[[nodiscard]] std::optional<std::uint16_t> netpbm_peak(
    std::span<const std::uint8_t> bytes) noexcept;
/// To 8-bit grey, `deep_bits` of 16 used. Precondition: check_netpbm() is ok, `size` is its size.
void decode_netpbm(std::span<const std::uint8_t> bytes, std::uint8_t* out, std::size_t stride,
                   int deep_bits) noexcept;

}  // namespace vergence::app::detail
