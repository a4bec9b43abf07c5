#pragma once
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace vergence::test {

/// Where recorded data would lie: $VERGENCE_SHARED, else the folder `shared` beside the source
/// tree.
[[nodiscard]] inline std::filesystem::path shared_root() {
  if (const char* named = std::getenv("VERGENCE_SHARED"); named != nullptr && *named != '\0')
    return named;
  return std::filesystem::path(VERGENCE_SOURCE_DIR) / ".." / "shared";
}

/// A file or folder below the shared root ("data/kitti06_51"), or nothing when it is not on this
/// machine:
///
///     const auto folder = test::shared_data("data/kitti06_51");
///     if (!folder) GTEST_SKIP() << test::shared_data_missing("data/kitti06_51");
[[nodiscard]] inline std::optional<std::filesystem::path> shared_data(
    const std::filesystem::path& below) {
  std::filesystem::path found = shared_root() / below;
  std::error_code ignored;
  if (!std::filesystem::exists(found, ignored)) return std::nullopt;
  return found.lexically_normal();
}

/// The message a skipped test gives.
[[nodiscard]] inline std::string shared_data_missing(const std::filesystem::path& below) {
  return "needs the recorded data " + below.string() +
         ", which is not here: put it into ../shared or name its place in VERGENCE_SHARED";
}

}  // namespace vergence::test
