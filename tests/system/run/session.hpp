#pragma once
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace vergence::test {

/// A quarter of the pixels: the mock's rig and drive in a quarter of the time.
inline const std::string kSmall =
    " --set cameras.0.size=[320,240] --set cameras.1.size=[320,240] --set mock.texture_detail=0";

/// All bytes of a file; empty while there is none.
[[nodiscard]] inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}

[[nodiscard]] inline std::size_t lines_of(const std::filesystem::path& file) {
  const std::string text = text_of(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

[[nodiscard]] inline nlohmann::json summary_of(const std::filesystem::path& session) {
  return nlohmann::json::parse(text_of(session / "summary.json"));
}

/// Sentences of a session's events of one kind.
[[nodiscard]] inline std::vector<std::string> events(const std::filesystem::path& session,
                                                     const std::string& kind) {
  std::istringstream in(text_of(session / "events.jsonl"));
  std::vector<std::string> found;
  for (std::string line; std::getline(in, line);) {
    const auto event = nlohmann::json::parse(line);
    if (event["kind"] == kind) found.push_back(event["message"]);
  }
  return found;
}

}  // namespace vergence::test
