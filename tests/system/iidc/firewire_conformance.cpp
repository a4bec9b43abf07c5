#include "drivers/iidc/iidc.hpp"
#include "tests/system/iidc/bus_conformance.hpp"

namespace vergence::test {

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t) {
  if (!inside_rig()) return nullptr;
  return std::make_unique<BusConformance>(iidc::make_1394_driver(), "sim_1394", "plug 0", "plug 1");
}

}  // namespace vergence::test
