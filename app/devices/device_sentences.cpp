#include "app/devices/device_sentences.hpp"

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {

std::string serial_open_error(const std::string& who, DeviceStatus status,
                              const std::string& error) {
  switch (status) {
    case DeviceStatus::busy:
      return fmt::format(
          "{} is in use by another program; end that one (ModemManager opens new ports: tell it "
          "not to)",
          who);
    case DeviceStatus::no_permission:
      return fmt::format(
          "{} cannot be opened without permission; add the user to group dialout, and log in again",
          who);
    default:
      return fmt::format("{} cannot be used: {}", who,
                         error.empty() ? std::string(to_string(status)) : error);
  }
}

void refuse_device(DeviceStatus status, const std::string& sentence) {
  switch (status) {
    case DeviceStatus::unsupported:
    case DeviceStatus::bad_configuration:
    case DeviceStatus::no_bandwidth:
      throw InputError(sentence);
    case DeviceStatus::ok:
    case DeviceStatus::timeout:
    case DeviceStatus::stopped:
    case DeviceStatus::ended:
    case DeviceStatus::gone:
    case DeviceStatus::not_found:
    case DeviceStatus::no_permission:
    case DeviceStatus::busy:
    case DeviceStatus::failed:
      break;
  }
  throw DeviceError(sentence);
}

void require_configured(const std::string& title, DeviceStatus status, const std::string& error) {
  if (status == DeviceStatus::ok) return;
  refuse_device(status, fmt::format("{}: {}", title,
                                    error.empty() ? fmt::format("cannot do what is asked: {}",
                                                                to_string(status))
                                                  : error));
}

}  // namespace vergence::app
