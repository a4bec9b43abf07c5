#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

#include "core/types/time.hpp"

/// What both logs of a St Lucia folder share.
namespace vergence::app::detail {

/// The one file in `folder` whose name ends so; nothing: there is none. InputError: several, or the
/// folder cannot be listed.
[[nodiscard]] std::optional<std::filesystem::path> find_st_lucia_log(
    const std::filesystem::path& folder, std::string_view ending);

/// Seconds and microseconds of the second, which are not padded: "5" and "1234" are 5.001234 s.
/// Nothing: they are no such pair.
[[nodiscard]] std::optional<Stamp> st_lucia_stamp(std::string_view seconds,
                                                  std::string_view microseconds) noexcept;

}  // namespace vergence::app::detail
