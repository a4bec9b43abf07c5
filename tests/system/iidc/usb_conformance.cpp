#include "drivers/iidc/iidc.hpp"
#include "tests/system/iidc/bus_conformance.hpp"

namespace vergence::test {

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t, std::string* why) {
  if (!inside_rig()) {
    *why = "needs the rig's kernel: run it by ctest -L rig";
    return nullptr;
  }
  return std::make_unique<BusConformance>(iidc::make_usb_driver(), "sim_usb_iidc", "unplug 0",
                                          "replug 0");
}

}  // namespace vergence::test
