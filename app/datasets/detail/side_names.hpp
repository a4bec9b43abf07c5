#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

/// How people call the left and the right of two cameras: in names of folders, images and topics.
namespace vergence::app::detail {

/// The names that are of a left camera, each with the name that its right one would have, where the
/// list has it: `left/image_raw` and `right/image_raw`, `cam0` and `cam1`, `I1_000000.png` and
/// `I2_000000.png`. Capitals do not count. All pairs by the first of the usual words that makes
/// one.
[[nodiscard]] std::vector<std::array<std::string, 2>> stereo_names(
    const std::vector<std::string>& names);

/// The two words of the pair that are the most frequent beginning of these file names, `I1_` and
/// `I2_`, as they are written there; empty: they have none.
[[nodiscard]] std::array<std::string, 2> side_prefixes(const std::vector<std::string>& names);

/// In small letters.
[[nodiscard]] std::string lower(std::string_view text);

}  // namespace vergence::app::detail
