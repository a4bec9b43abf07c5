#pragma once
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/serial/serial_port.hpp"
#include "drivers/trigger.hpp"
#include "drivers/trigger_board/device.hpp"
#include "drivers/trigger_board/options.hpp"

namespace vergence::trigger_board {

/// Trigger boards on serial links: the row `board` of the table of trigger drivers.
///
/// A trigger board is identified by its answer to HELLO. Ports of USB converters and boards are
/// queried, except those of XSens' own converters. Not thread-safe.
class Driver final : public TriggerDriver {
 public:
  /// Access to the machine's ports; replaced in tests.
  struct Ports {
    std::function<std::vector<SerialPortInfo>()> list;
    std::function<std::unique_ptr<SerialLinkFactory>(const std::string& port)> at;
  };

  explicit Driver(const Options& options = {});
  Driver(const Options& options, Ports ports) : options_(options), ports_(std::move(ports)) {}

  /// Trigger boards that answer; ports in use are skipped. Takes up to three seconds for a port
  /// without an answer.
  [[nodiscard]] std::vector<DeviceInfo> enumerate() override;
  /// Opens a trigger board. `where` is a port (`/dev/ttyACM0` or a link to one), a serial number of
  /// enumerate(), or empty for the only one. → ok, not_found, no_permission, busy, unsupported,
  /// bad_configuration (ambiguous), disconnected, failed
  [[nodiscard]] std::unique_ptr<TriggerDevice> open(std::string_view where,
                                                    DeviceStatus* status) override;
  /// Opens a trigger board with its additional interface.
  [[nodiscard]] std::unique_ptr<Device> open_board(std::string_view where, DeviceStatus* status);
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  [[nodiscard]] std::unique_ptr<Device> open_port(const std::string& port, DeviceStatus* status);
  [[nodiscard]] std::unique_ptr<Device> find_board(std::string_view serial, DeviceStatus* status);
  [[nodiscard]] std::vector<std::string> candidates() const;

  Options options_;
  Ports ports_;
  std::string last_error_;
};

}  // namespace vergence::trigger_board
