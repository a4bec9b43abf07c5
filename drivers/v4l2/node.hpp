#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/unique_fd.hpp"

namespace vergence::v4l2 {

/// ioctl(2), again after a signal. → 0 or the errno.
[[nodiscard]] int control(int fd, unsigned long request, void* argument) noexcept;

/// A node that captures and streams.
struct Node {
  std::string path;        // /dev/video0
  std::string serial;      // as DeviceInfo: the camera's own, whatever it is found by
  std::string found_by;    // find_node()'s: its serial or a path under /dev
  std::string card;        // the device's name
  std::string bus;         // as the kernel names it
  std::uint32_t type = 0;  // of buffers: V4L2_BUF_TYPE_VIDEO_CAPTURE or …_MPLANE
};

/// → ok, not_found, no_permission, unsupported (does not capture and stream), disconnected, failed.
/// Not
///   `ok`: nothing stays open.
[[nodiscard]] DeviceStatus open_node(const std::string& path, UniqueFd* fd, Node* node);

struct NodeList {
  std::vector<Node> nodes;          // that capture, in order of their numbers
  std::vector<std::string> closed;  // paths we may not open
};
[[nodiscard]] NodeList list_nodes();

/// The node with that serial (empty: the first), or at that path under /dev. → ok, not_found,
/// no_permission, and as open_node().
[[nodiscard]] DeviceStatus find_node(std::string_view serial, UniqueFd* fd, Node* node);

}  // namespace vergence::v4l2
