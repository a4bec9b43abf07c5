#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/ins.hpp"
#include "drivers/xsens/options.hpp"

namespace vergence::xsens {

/// XSens INS on serial lines: the row `xsens` of the table of INS drivers.
///
/// open() takes a port (`/dev/ttyUSB0`, a link to one), not a serial number: an INS is found by the
/// line it is on, and asked who it is.
class Driver final : public InsDriver {
 public:
  explicit Driver(const Options& options = {}) : options_(options) {}

  /// Ports on which one could be: those of USB converters. Nothing is sent to them.
  [[nodiscard]] std::vector<DeviceInfo> enumerate() override;
  /// Opens and asks. `port` empty: the only USB converter there is. → ok, not_found, no_permission,
  /// busy, unsupported, gone, failed
  [[nodiscard]] std::unique_ptr<InsDevice> open(std::string_view port,
                                                DeviceStatus* status) override;
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  Options options_;
  std::string last_error_;
};

}  // namespace vergence::xsens
