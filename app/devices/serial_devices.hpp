#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "drivers/device.hpp"
#include "drivers/ins.hpp"
#include "drivers/serial/serial_link.hpp"
#include "drivers/trigger_board/device.hpp"
#include "drivers/xsens/options.hpp"

namespace vergence::app {

/// Why a device on a serial port cannot be opened. `who`: `ins: the xsens INS on /dev/ttyUSB0`;
/// `error`: the driver's message, may be empty.
[[nodiscard]] std::string serial_open_error(const std::string& who, DeviceStatus status,
                                            const std::string& error);

/// Throws: InputError where the request is at fault (a device cannot do it, it makes no sense, one
/// of several is not named), DeviceError where the device is: the same may succeed later.
[[noreturn]] void refuse_device(DeviceStatus status, const std::string& message);

/// refuse_device() unless `ok`: the device's title, and its message or the status.
void require_configured(const std::string& title, DeviceStatus status, const std::string& error);

/// An INS as configured.
struct InsRequest {
  std::string driver;  // `none`: there is none
  std::string port;    // empty: the only one there is
  double rate_hz = 100;
  std::uint32_t baud = 0;  // 0: as the device has it
  double sync_out_hz = 0;  // 0: as the device has it; negative: off
  double sync_out_width_ms = 1;
  double processing_ms = 2;
};

[[nodiscard]] InsRequest ins_request(const InsSettings& settings);

/// A kind of INS that a configuration can name.
struct InsDriverRow {
  const char* name;     // of `ins.driver`
  const char* meaning;  // for lists
  std::unique_ptr<InsDriver> (*make)(const InsRequest& request);
};

/// The table of drivers for real INS: everything that talks to one is chosen here. The mock's INS
/// comes from its rig.
[[nodiscard]] const std::vector<InsDriverRow>& ins_driver_rows();
[[nodiscard]] std::vector<std::string> ins_driver_names();

/// The row of that name; null: none has it.
[[nodiscard]] const InsDriverRow* find_ins_driver(const std::string& name);

/// Opens and configures it; null for `none`.
///
/// Errors  As refuse_device(), one message: the key, what was found, what to do. Nothing
///         stays open then.
/// `remarks`: messages about what works, but not as asked.
[[nodiscard]] std::unique_ptr<InsDevice> open_ins(const InsRequest& request,
                                                  std::vector<std::string>* remarks);

/// An INS for a message: `ins (xsens 07701234, MTI-G-710 on /dev/ttyUSB0)`.
[[nodiscard]] std::string ins_title(const DeviceInfo& info);

/// Opens the trigger board and configures it; from then on it makes no pulse until it is started.
///
/// Errors  As refuse_device(), one message: the key, what was found, what to do. Nothing
///         stays open then.
/// `remarks`: messages about what works, but not as asked.
[[nodiscard]] std::unique_ptr<trigger_board::Device> open_trigger_board(
    const TriggerSettings& settings, const TriggerConfiguration& pulses,
    std::vector<std::string>* remarks);

/// Driver options of a trigger board of this configuration.
[[nodiscard]] trigger_board::Options trigger_board_options(const TriggerSettings& settings);

/// A board for a message: `trigger (board 3000…, on /dev/ttyACM0)`.
[[nodiscard]] std::string board_title(const DeviceInfo& info);

}  // namespace vergence::app
