#pragma once
#include <libusb-1.0/libusb.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "drivers/device.hpp"
#include "firmware_iface/iidc/config_rom.hpp"

/// IIDC cameras among the devices on USB, and their registers.
namespace vergence::iidc {

inline constexpr Duration kUsbRegisterLimit = Duration::seconds(1);

/// One attached device that may be an IIDC camera.
struct UsbCandidate {
  DeviceInfo info{};             // serial: the GUID; empty when it could not be opened
  std::string transport_serial;  // the USB string
  std::uint64_t guid = 0;
  DeviceStatus access = DeviceStatus::ok;  // why it could not be asked
};

/// Every device with a known id, each asked for its GUID; in that order.
[[nodiscard]] std::vector<UsbCandidate> find_usb_cameras(std::string* error);

/// One that is looked at; `handle` is null where `who.access` is not ok.
struct FoundUsbCamera {
  UsbCandidate who;
  ConfigRom rom;
  libusb_device* device = nullptr;
  libusb_device_handle* handle = nullptr;
};
/// Opens each in turn and calls back; true ends it. Whoever does not take the handle (sets it to
/// null) has it closed.
/// False: the system's devices cannot be listed.
bool for_each_usb_camera(libusb_context* context, std::string* error,
                         const std::function<bool(FoundUsbCamera*)>& look);

[[nodiscard]] DeviceStatus usb_status(int libusb_error) noexcept;
[[nodiscard]] DeviceStatus read_usb_quadlet(libusb_device_handle* handle, std::uint64_t address,
                                            std::uint32_t* value) noexcept;
[[nodiscard]] DeviceStatus write_usb_quadlet(libusb_device_handle* handle, std::uint64_t address,
                                             std::uint32_t value) noexcept;

inline constexpr const char* kNoUsb = "the system's USB devices cannot be listed";

}  // namespace vergence::iidc
