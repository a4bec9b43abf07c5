#pragma once
#include <algorithm>

#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

/// A quarter of the pixels: the mock's rig and drive in a quarter of the time.
inline const std::string kSmall =
    " --set cameras.0.size=[320,240] --set cameras.1.size=[320,240] --set mock.texture_detail=0";

/// Number of lines of a file; 0 while there is none.
[[nodiscard]] inline std::ptrdiff_t lines_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return std::count(std::istreambuf_iterator<char>(in), {}, '\n');
}

[[nodiscard]] inline nlohmann::json summary_of(const std::filesystem::path& session) {
  return nlohmann::json::parse(read_file(session / "summary.json"));
}

/// Sentences of a session's events of one kind.
[[nodiscard]] inline std::vector<std::string> events(const std::filesystem::path& session,
                                                     const std::string& kind) {
  std::vector<std::string> found;
  for (const std::string& line : read_lines(session / "events.jsonl")) {
    const auto event = nlohmann::json::parse(line);
    if (event["kind"] == kind) found.push_back(event["message"]);
  }
  return found;
}

}  // namespace vergence::test
