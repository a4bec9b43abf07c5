#include "drivers/xsens/xsens.hpp"

#include "drivers/common/serial_ins_driver.hpp"
#include "drivers/xsens/device.hpp"

namespace vergence::xsens {

std::unique_ptr<InsDriver> make_driver(const Options& options) {
  return std::make_unique<SerialInsDriver<Device, Options>>("xsens", options);
}

}  // namespace vergence::xsens
