#pragma once

#include "app/datasets/detail/bag_scan.hpp"

namespace vergence::test {

struct ReadMessage {
  /// The type as ROS 1 writes it.
  std::string topic, type;
  std::string content;
};

struct ReadFile {
  std::vector<ReadMessage> messages;
  app::detail::BagScan scan;
};

/// Every message of an MCAP file, by the program's reader of bags. One that does not begin as such
/// a file has none.
[[nodiscard]] inline ReadFile read_mcap(const std::filesystem::path& file) {
  ReadFile out;
  const app::detail::FileBytes bytes(file);
  const auto scan = app::detail::scan_mcap(bytes, [&](const app::detail::BagMessage& m) {
    std::string content(m.place.size, '\0');
    if (!m.bytes->read(m.place.offset,
                       {reinterpret_cast<std::uint8_t*>(content.data()), content.size()}))
      content = "unreadable";
    out.messages.push_back({m.channel->topic, m.channel->type, content});
  });
  if (scan) out.scan = *scan;
  return out;
}

}  // namespace vergence::test
