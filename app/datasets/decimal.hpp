#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace vergence::app {

/// Parses a decimal number times 10^decimals exactly, without a double. Further digits round half
/// away from zero. Empty if it is not a number (including blanks) or exceeds 64 bits.
[[nodiscard]] std::optional<std::int64_t> parse_decimal(std::string_view text,
                                                        int decimals) noexcept;
/// Parses seconds and returns nanoseconds (`12`, `-0.5`, `1.044989e-01`).
[[nodiscard]] std::optional<std::int64_t> parse_seconds_ns(std::string_view text) noexcept;

/// Parses the whole text as a decimal integer; empty otherwise.
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view text) noexcept;

/// Nanoseconds as seconds with nine decimals, such as `-0.000000001`, without rounding.
[[nodiscard]] std::string format_seconds(std::int64_t ns);
/// Appends to *line without allocating if the line has room.
void append_seconds(std::string* line, std::int64_t ns);

/// Removes blanks, tabs and carriage returns at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;

}  // namespace vergence::app
