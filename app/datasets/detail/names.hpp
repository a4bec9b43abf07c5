#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Names of folders, images and topics: their order, and how people call the left and the right of
/// two cameras.
namespace vergence::app::detail {

/// The names that are of a left camera, each with the name that its right one would have, where the
/// list has it: `left/image_raw` and `right/image_raw`, `cam0` and `cam1`, `I1_000000.png` and
/// `I2_000000.png`. Capitals do not count. All pairs by the first of the usual words that makes
/// one.
[[nodiscard]] std::vector<std::array<std::string, 2>> stereo_names(
    const std::vector<std::string>& names);

/// The two words, in small letters, that tell the images of a left and a right camera in one folder
/// apart: `I1_000000.png` and `I2_000000.png`, `000000_left.png` and `000000_right.png`; empty:
/// most names have none.
[[nodiscard]] std::array<std::string, 2> side_names(const std::vector<std::string>& files);

/// The name in small letters without that word; nothing: it does not have it.
[[nodiscard]] std::optional<std::string> without_side(const std::string& name,
                                                      const std::string& word);

/// True if `a` sorts before `b` where runs of digits count as numbers, whether they have leading
/// zeros or not: `left/2.png` before `left/10.png`. A strict order: names of one number with and
/// without zeros differ, the one with fewer digits first.
[[nodiscard]] bool in_name_order(std::string_view a, std::string_view b) noexcept;

/// In small letters.
[[nodiscard]] std::string lower(std::string_view text);

}  // namespace vergence::app::detail
