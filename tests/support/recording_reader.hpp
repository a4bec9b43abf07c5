#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/datasets/detail/mcap.hpp"

namespace vergence::test {

struct ReadMessage {
  std::string topic, type;
  std::uint64_t log_time = 0;
  std::string content;
};

struct ReadFile {
  std::vector<ReadMessage> messages;
  app::detail::McapScan scan;
};

/// Every message of an MCAP file, by the program's reader of bags.
[[nodiscard]] inline ReadFile read_mcap(const std::filesystem::path& file) {
  ReadFile out;
  const app::detail::FileBytes bytes(file);
  out.scan = app::detail::scan_mcap(bytes, [&](const app::detail::McapMessage& m) {
    std::string content(m.place.size, '\0');
    if (!m.bytes->read(m.place.offset,
                       {reinterpret_cast<std::uint8_t*>(content.data()), content.size()}))
      content = "unreadable";
    out.messages.push_back({m.channel->topic, m.channel->type, m.log_time, content});
  });
  return out;
}

}  // namespace vergence::test
