#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Order of names of directories, images and topics, and usual words for left and right.
namespace vergence::app::detail {

/// Names of left cameras, each with the right name if the list has it: `left/image_raw` and
/// `right/image_raw`, `cam0` and `cam1`, `I1_000000.png` and `I2_000000.png`. Case-insensitive. All
/// pairs use the first of the usual words that makes one.
[[nodiscard]] std::vector<std::array<std::string, 2>> stereo_names(
    const std::vector<std::string>& names);

/// The two words in lower case that distinguish left and right images in one directory:
/// `I1_000000.png` and `I2_000000.png`, `000000_left.png` and `000000_right.png`; empty if most
/// names have none.
[[nodiscard]] std::array<std::string, 2> side_names(const std::vector<std::string>& files);

/// Name in lower case without that word; empty if it lacks the word.
[[nodiscard]] std::optional<std::string> without_side(const std::string& name,
                                                      const std::string& word);

/// True if `a` sorts before `b` with runs of digits as numbers, ignoring leading zeros:
/// `left/2.png` before `left/10.png`. A strict order: of equal numbers the one with fewer digits
/// comes first.
[[nodiscard]] bool in_name_order(std::string_view a, std::string_view b) noexcept;

/// True if the file or directory exists and can be reached.
[[nodiscard]] bool present(const std::filesystem::path& path);
/// Entries of a directory in the order of their names; empty if it cannot be listed, for the reason
/// in *error.
[[nodiscard]] std::vector<std::filesystem::path> entries_in(const std::filesystem::path& folder,
                                                            std::error_code* error = nullptr);

/// Converts to lower case.
[[nodiscard]] std::string lower(std::string_view text);

}  // namespace vergence::app::detail
