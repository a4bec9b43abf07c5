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
    complaint_.clear();
    std::vector<DeviceInfo> out;
    for (UsbCandidate& c : find_usb_cameras(&complaint_)) out.push_back(std::move(c.info));
    return out;
  }
  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    complaint_.clear();
    auto bus = UsbBus::open(serial, status, &complaint_);
    if (bus == nullptr) return nullptr;
    const ConfigRom rom = bus->rom();
    return std::make_unique<IidcCamera>(std::move(bus), rom, nullptr);
  }
  std::string complaint() const override { return complaint_; }

 private:
  std::string complaint_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_usb_driver() { return std::make_unique<UsbDriver>(); }

}  // namespace vergence::iidc
