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

/// Trigger boards on serial lines: the row `board` of the table of trigger drivers.
///
/// A board is known by what it answers to HELLO. Asked are the ports of USB converters and boards,
/// but those of XSens' own converters.
/// Threads  One caller. Errors: TriggerDriver's.
class Driver final : public TriggerDriver {
 public:
  /// Ports of the machine; tests bring their own.
  struct Ports {
    std::function<std::vector<SerialPortInfo>()> list;
    std::function<std::unique_ptr<SerialLinkFactory>(const std::string& port)> at;
  };

  explicit Driver(const Options& options = {});
  Driver(const Options& options, Ports ports) : options_(options), ports_(std::move(ports)) {}

  /// Boards that answer now; a port that somebody holds is passed over. Takes up to three seconds
  /// for a port where none answers.
  [[nodiscard]] std::vector<DeviceInfo> enumerate() override;
  /// `where`: a port (`/dev/ttyACM0`, a link to one), a board's serial number as enumerate() tells
  /// it, or empty: the only board there is.
  /// → ok, not_found, no_permission, busy, unsupported, bad_configuration (more than one may be
  /// meant), disconnected, failed
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
