#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/iidc/bus_ledger.hpp"
#include "drivers/iidc/firewire_bus.hpp"
#include "drivers/iidc/identity.hpp"
#include "drivers/iidc/iidc.hpp"
#include "drivers/iidc/iidc_camera.hpp"

namespace vergence::iidc {
namespace {

class FirewireDriver final : public CameraDriver {
 public:
  std::vector<DeviceInfo> enumerate() override {
    last_error_ = has_firewire() ? "" : "this kernel has no FireWire stack: modprobe firewire-ohci";
    std::vector<DeviceInfo> out;
    for (const FirewireNode& n : list_firewire_cameras())
      out.push_back({"iidc-1394", guid_text(n.rom.guid),
                     n.rom.model[0] != 0 ? n.rom.model.data() : "IIDC camera", n.device});
    return out;
  }
  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    last_error_.clear();
    auto bus = FirewireBus::open(serial, ledger_, status, &last_error_);
    if (bus == nullptr) return nullptr;
    const ConfigRom rom = bus->rom();
    auto clock = bus->clock();
    return std::make_unique<IidcCamera>(std::move(bus), rom, std::move(clock));
  }
  std::string last_error() const override { return last_error_; }

 private:
  std::shared_ptr<BusLedger> ledger_ = std::make_shared<BusLedger>();
  std::string last_error_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_1394_driver() { return std::make_unique<FirewireDriver>(); }

}  // namespace vergence::iidc
