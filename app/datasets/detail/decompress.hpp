#pragma once
#include <cstdint>
#include <span>
#include <string_view>

namespace vergence::app::detail {

/// The frame or frames of `packed` as `name` says ("zstd", "lz4", "bz2"), exactly `records.size()`
/// bytes. False: they are not.
[[nodiscard]] bool decompress(std::string_view name, std::span<const std::uint8_t> packed,
                              std::span<std::uint8_t> records) noexcept;

}  // namespace vergence::app::detail
