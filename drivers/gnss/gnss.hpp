#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/gnss/options.hpp"
#include "drivers/ins.hpp"

namespace vergence::gnss {

/// Satellite receivers on serial lines: the rows `nmea` and `ubx` of the table of INS drivers.
/// open() takes a port, as xsens::Driver.
class Driver final : public InsDriver {
 public:
  explicit Driver(const Options& options) : options_(options) {}

  /// Ports on which one could be: those on USB. Nothing is sent to them.
  [[nodiscard]] std::vector<DeviceInfo> enumerate() override;
  /// Opens and listens. `port` empty: the only serial port on USB. → as Device::connect()
  [[nodiscard]] std::unique_ptr<InsDevice> open(std::string_view port,
                                                DeviceStatus* status) override;
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  Options options_;
  std::string last_error_;
};

}  // namespace vergence::gnss
