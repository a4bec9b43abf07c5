#include "drivers/iidc/iidc.hpp"
#include "tests/system/iidc/bus_conformance.hpp"

namespace vergence::test {

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t) {
  if (!inside_rig()) return nullptr;
  return std::make_unique<BusConformance>(iidc::make_usb_driver(), "sim_usb_iidc", "unplug 0",
                                          "replug 0");
}

}  // namespace vergence::test
