#include "drivers/gnss/gnss.hpp"

#include "drivers/common/serial_ins_driver.hpp"
#include "drivers/gnss/device.hpp"

namespace vergence::gnss {

std::unique_ptr<InsDriver> make_driver(const Options& options) {
  const char* name = options.protocol == Protocol::nmea ? "nmea" : "ubx";
  return std::make_unique<SerialInsDriver<Device, Options>>(name, options);
}

}  // namespace vergence::gnss
