#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace vergence::app {

/// A decimal number times 10^decimals, exact: no double in between. Digits beyond round half away
/// from zero. Nothing: not a number (blanks included), or beyond what 64 bits hold.
[[nodiscard]] std::optional<std::int64_t> parse_decimal(std::string_view text,
                                                        int decimals) noexcept;
/// Parses seconds and returns nanoseconds (`12`, `-0.5`, `1.044989e-01`).
[[nodiscard]] std::optional<std::int64_t> parse_seconds_ns(std::string_view text) noexcept;

/// The whole text as a decimal integer. Nothing: anything else.
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view text) noexcept;

/// Nanoseconds as seconds with nine decimals, `-0.000000001`: the integer's digits, nothing
/// rounded.
[[nodiscard]] std::string format_seconds(std::int64_t ns);
/// Appends to *line without allocating if the line has room.
void append_seconds(std::string* line, std::int64_t ns);

/// Without blanks, tabs and carriage returns at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;

}  // namespace vergence::app
