#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/unique_fd.hpp"

namespace vergence::v4l2 {

/// Calls ioctl(2) and repeats it after a signal. Returns 0 or the errno.
[[nodiscard]] int control(int fd, unsigned long request, void* argument) noexcept;

/// Video node that captures and streams.
struct Node {
  /// Path of the node, as in /dev/video0.
  std::string path;
  /// The camera's own serial number as in DeviceInfo, regardless of how it was found.
  std::string serial;
  /// Serial number or path under /dev for find_node().
  std::string found_by;
  /// Name of the device.
  std::string card;
  /// Bus name given by the kernel.
  std::string bus;
  /// Buffer type: V4L2_BUF_TYPE_VIDEO_CAPTURE or …_MPLANE.
  std::uint32_t type = 0;
};

/// Opens a node. If not `ok`, nothing stays open. → ok, not_found, no_permission, unsupported (does
/// not capture and stream), disconnected, failed
[[nodiscard]] DeviceStatus open_node(const std::string& path, UniqueFd* fd, Node* node);

struct NodeList {
  /// Capturing nodes, in order of their numbers.
  std::vector<Node> nodes;
  /// Paths that this process may not open.
  std::vector<std::string> closed;
};
[[nodiscard]] NodeList list_nodes();

/// Finds the node with that serial number (empty: the first) or at that path under /dev. → ok,
/// not_found, no_permission, and those of open_node()
[[nodiscard]] DeviceStatus find_node(std::string_view serial, UniqueFd* fd, Node* node);

}  // namespace vergence::v4l2
