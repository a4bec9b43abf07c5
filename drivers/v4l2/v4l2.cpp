#include "drivers/v4l2/v4l2.hpp"

#include "drivers/v4l2/camera_device.hpp"
#include "drivers/v4l2/node.hpp"

namespace vergence::v4l2 {
namespace {

class Driver final : public CameraDriver {
 public:
  std::vector<DeviceInfo> enumerate() override {
    last_error_.clear();
    std::vector<DeviceInfo> found;
    const NodeList list = list_nodes();
    for (const Node& n : list.nodes) found.push_back({"v4l2", n.serial, n.card, n.path});
    if (found.empty() && !list.closed.empty()) last_error_ = permission(list.closed.front());
    return found;
  }

  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    last_error_.clear();
    UniqueFd fd;
    Node node;
    *status = find_node(serial, &fd, &node);
    if (*status == DeviceStatus::ok)
      return std::make_unique<V4l2Camera>(std::move(fd), std::move(node));
    const std::string name = serial.empty() ? "any camera" : std::string(serial);
    switch (*status) {
      case DeviceStatus::no_permission:
        last_error_ = permission(name);
        break;
      case DeviceStatus::unsupported:
        last_error_ = name + " does not capture and stream; `vergence devices` lists nodes that do";
        break;
      case DeviceStatus::disconnected:
        *status = DeviceStatus::not_found;
        [[fallthrough]];
      default:
        break;
    }
    return nullptr;
  }

  std::string last_error() const override { return last_error_; }

 private:
  static std::string permission(const std::string& node) {
    return node +
           ": no permission to open it; add the user to the group video (sudo usermod -aG video "
           "$USER) and log in again";
  }
  std::string last_error_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_driver() { return std::make_unique<Driver>(); }

}  // namespace vergence::v4l2
