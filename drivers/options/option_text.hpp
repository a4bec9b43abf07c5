#pragma once
#include <optional>
#include <string>
#include <string_view>

/// How the values of options are written.
namespace vergence {

/// The whole text is one finite number.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);
/// on, yes, true; off, no, false.
[[nodiscard]] std::optional<bool> parse_switch(std::string_view text);
/// The shortest text that reads back as the same number.
[[nodiscard]] std::string shortest_text(double value);

}  // namespace vergence
