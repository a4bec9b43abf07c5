#include <string>
#include <utility>
#include <vector>

#include "drivers/iidc/iidc.hpp"
#include "drivers/iidc/iidc_camera.hpp"
#include "drivers/iidc/usb_bus.hpp"

namespace vergence::iidc {
namespace {

class UsbDriver final : public CameraDriver {
 public:
  std::vector<DeviceInfo> enumerate() override {
    last_error_.clear();
    std::vector<DeviceInfo> out;
    for (UsbCandidate& c : find_usb_cameras(&last_error_)) out.push_back(std::move(c.info));
    return out;
  }
  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    last_error_.clear();
    auto bus = UsbBus::open(serial, status, &last_error_);
    if (bus == nullptr) return nullptr;
    const ConfigRom rom = bus->rom();
    return std::make_unique<IidcCamera>(std::move(bus), rom, nullptr);
  }
  std::string last_error() const override { return last_error_; }

 private:
  std::string last_error_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_usb_driver() { return std::make_unique<UsbDriver>(); }

}  // namespace vergence::iidc
