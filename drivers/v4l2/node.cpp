#include "drivers/v4l2/node.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace vergence::v4l2 {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kDevices = "/dev";
// Levels searched above the video device: USB interface and device, or a bridge and its bus.
constexpr int kParents = 4;

/// Text of a fixed field that may lack a terminating zero.
template <std::size_t N>
std::string text(const __u8 (&field)[N]) {
  const char* first = reinterpret_cast<const char*>(field);
  return {first, std::find(first, first + N, '\0')};
}

std::string usb_serial(const std::string& name) {
  std::error_code error;
  fs::path at = fs::canonical(fs::path("/sys/class/video4linux") / name / "device", error);
  for (int i = 0; !error && i < kParents && at.has_relative_path(); ++i, at = at.parent_path()) {
    std::ifstream file(at / "serial");
    std::string serial;
    if (file && std::getline(file, serial) && !serial.empty()) return serial;
  }
  return {};
}

/// Numbers of the existing /dev/videoN.
std::vector<int> node_numbers() {
  std::vector<int> numbers;
  std::error_code error;
  constexpr std::string_view kPrefix = "video";
  for (fs::directory_iterator it(kDevices, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename();
    if (!name.starts_with(kPrefix) || name.size() == kPrefix.size() ||
        name.size() > kPrefix.size() + 6)
      continue;
    const std::string digits = name.substr(kPrefix.size());
    if (std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; }))
      numbers.push_back(std::stoi(digits));
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error) && !error;
}

}  // namespace

int control(int fd, unsigned long request, void* argument) noexcept {
  int result = 0;
  do result = ::ioctl(fd, request, argument);
  while (result != 0 && errno == EINTR);
  return result == 0 ? 0 : errno;
}

DeviceStatus open_node(const std::string& path, UniqueFd* out, Node* node) {
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd.valid()) {
    switch (errno) {
      case EACCES:
      case EPERM:
        return DeviceStatus::no_permission;
      case ENOENT:
        return DeviceStatus::not_found;
      case ENODEV:
      case ENXIO:
        return DeviceStatus::disconnected;
      default:
        return DeviceStatus::failed;
    }
  }
  v4l2_capability cap{};
  if (const int error = control(fd.get(), VIDIOC_QUERYCAP, &cap); error != 0)
    return error == ENODEV ? DeviceStatus::disconnected : DeviceStatus::unsupported;
  const std::uint32_t has =
      (cap.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? cap.device_caps : cap.capabilities;
  const bool planes = (has & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  if ((has & V4L2_CAP_STREAMING) == 0 || ((has & V4L2_CAP_VIDEO_CAPTURE) == 0 && !planes))
    return DeviceStatus::unsupported;

  Node found;
  found.path = path;
  found.card = text(cap.card);
  found.bus = text(cap.bus_info);
  found.type = planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  found.serial = usb_serial(error ? fs::path(path).filename() : real.filename());
  if (found.serial.empty()) found.serial = found.bus;
  *node = std::move(found);
  *out = std::move(fd);
  return DeviceStatus::ok;
}

NodeList list_nodes() {
  NodeList list;
  for (const int number : node_numbers()) {
    const std::string path = std::string(kDevices) + "/video" + std::to_string(number);
    UniqueFd fd;
    Node node;
    const DeviceStatus status = open_node(path, &fd, &node);
    if (status == DeviceStatus::no_permission) list.closed.push_back(path);
    if (status != DeviceStatus::ok) continue;
    const auto same = [base = node.serial](const Node& n) {
      return n.serial == base || n.serial.starts_with(base + "#");
    };
    if (const auto before = std::count_if(list.nodes.begin(), list.nodes.end(), same); before > 0)
      node.serial += "#" + std::to_string(before);
    list.nodes.push_back(std::move(node));
  }
  return list;
}

DeviceStatus find_node(std::string_view serial, UniqueFd* fd, Node* node) {
  if (serial.starts_with(std::string(kDevices) + "/")) {
    const DeviceStatus status = open_node(std::string(serial), fd, node);
    if (status != DeviceStatus::ok) return status;
    // Takes the listed serial number, which differs if several cameras share one.
    for (const Node& n : list_nodes().nodes)
      if (same_file(n.path, node->path)) node->serial = n.serial;
    node->found_by = serial;
    return status;
  }
  const NodeList list = list_nodes();
  for (const Node& n : list.nodes) {
    if (!serial.empty() && n.serial != serial) continue;
    const DeviceStatus status = open_node(n.path, fd, node);
    if (status == DeviceStatus::ok) node->serial = node->found_by = n.serial;
    return status;
  }
  return list.closed.empty() ? DeviceStatus::not_found : DeviceStatus::no_permission;
}

}  // namespace vergence::v4l2
