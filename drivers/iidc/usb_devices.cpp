#include "drivers/iidc/usb_devices.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "drivers/iidc/camera_registers.hpp"
#include "drivers/iidc/identity.hpp"

namespace vergence::iidc {
namespace {

constexpr std::uint16_t kPointGrey = 0x1E10;
struct Product {
  std::uint16_t id;
  const char* name;
};
constexpr std::array kProducts{
    Product{0x2000, "Firefly MV"},   Product{0x2001, "Firefly MV"}, Product{0x2002, "Firefly MV"},
    Product{0x2003, "Firefly MV"},   Product{0x2004, "Chameleon"},  Product{0x2005, "Chameleon"},
    Product{0x3000, "Flea3"},        Product{0x3005, "Flea3"},      Product{0x3006, "Flea3"},
    Product{0x3008, "Flea3"},        Product{0x300A, "Flea3"},      Product{0x300B, "Flea3"},
    Product{0x3103, "Grasshopper3"}, Product{0x3300, "Flea3"},      Product{0x3800, "Ladybug5"},
};

constexpr unsigned char kReadRequest = 0xC0, kWriteRequest = 0x40;  // vendor, device
constexpr unsigned char kQuadlets = 0x7F;                           // addresses 0xFFFF….
unsigned limit_ms() noexcept { return static_cast<unsigned>(kUsbRegisterLimit.ns() / 1'000'000); }

const Product* product_of(const libusb_device_descriptor& d) noexcept {
  if (d.idVendor != kPointGrey) return nullptr;
  for (const Product& p : kProducts)
    if (p.id == d.idProduct) return &p;
  return nullptr;
}

std::string place_of(libusb_device* device) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "usb %03d/%03d", libusb_get_bus_number(device),
                      libusb_get_device_address(device));
  return text.data();
}

std::string node_of(libusb_device* device) {
  std::array<char, 48> text{};
  (void)std::snprintf(text.data(), text.size(), "/dev/bus/usb/%03d/%03d",
                      libusb_get_bus_number(device), libusb_get_device_address(device));
  return text.data();
}

/// Registers of a device that is opened, but not yet anybody's camera.
class HandlePort final : public RegisterPort {
 public:
  explicit HandlePort(libusb_device_handle* handle) : handle_(handle) {}
  DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept override {
    return read_usb_quadlet(handle_, address, value);
  }
  DeviceStatus write(std::uint64_t, std::uint32_t) noexcept override {
    return DeviceStatus::unsupported;
  }

 private:
  libusb_device_handle* handle_;
};

/// Opens a device and asks who it is.
FoundUsbCamera ask(libusb_device* device, const libusb_device_descriptor& d, const Product& product,
                   std::string* message) {
  FoundUsbCamera found;
  found.device = device;
  UsbCandidate& who = found.who;
  who.info = {"iidc-usb", "", product.name, place_of(device)};
  const int error = libusb_open(device, &found.handle);
  if (error != LIBUSB_SUCCESS) {
    who.access = usb_status(error);
    if (who.access == DeviceStatus::no_permission)
      *message = "no permission to open " + node_of(device) +
                 ": install the udev rules (vergence devices --write-udev) and plug it in again";
    return found;
  }
  std::array<unsigned char, 64> text{};
  if (d.iSerialNumber != 0) {
    const int n = libusb_get_string_descriptor_ascii(found.handle, d.iSerialNumber, text.data(),
                                                     static_cast<int>(text.size()));
    if (n > 0) who.transport_serial.assign(text.begin(), text.begin() + n);
  }
  HandlePort port(found.handle);
  std::string why;
  who.access = read_rom(&port, &found.rom, &why);
  if (who.access != DeviceStatus::ok) {
    *message = std::string(product.name) + " at " + place_of(device) + ": " + why;
    libusb_close(found.handle);
    found.handle = nullptr;
    return found;
  }
  who.guid = found.rom.guid;
  who.info.serial = guid_text(who.guid);
  if (found.rom.model[0] != 0) who.info.model = found.rom.model.data();
  return found;
}

}  // namespace

DeviceStatus usb_status(int libusb_error) noexcept {
  switch (libusb_error) {
    case LIBUSB_SUCCESS:
      return DeviceStatus::ok;
    case LIBUSB_ERROR_TIMEOUT:
      return DeviceStatus::timeout;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return DeviceStatus::gone;
    case LIBUSB_ERROR_ACCESS:
      return DeviceStatus::no_permission;
    case LIBUSB_ERROR_BUSY:
      return DeviceStatus::busy;
    case LIBUSB_ERROR_PIPE:  // the device stalled the request
      return DeviceStatus::unsupported;
    default:
      return DeviceStatus::failed;
  }
}

DeviceStatus read_usb_quadlet(libusb_device_handle* handle, std::uint64_t address,
                              std::uint32_t* value) noexcept {
  std::array<unsigned char, 4> b{};
  const int got = libusb_control_transfer(
      handle, kReadRequest, kQuadlets, static_cast<std::uint16_t>(address & 0xFFFF),
      static_cast<std::uint16_t>(address >> 16U & 0xFFFF), b.data(), b.size(), limit_ms());
  if (got < 0) return usb_status(got);
  if (got != static_cast<int>(b.size())) return DeviceStatus::failed;
  *value = static_cast<std::uint32_t>(b[0]) | static_cast<std::uint32_t>(b[1]) << 8U |
           static_cast<std::uint32_t>(b[2]) << 16U | static_cast<std::uint32_t>(b[3]) << 24U;
  return DeviceStatus::ok;
}

DeviceStatus write_usb_quadlet(libusb_device_handle* handle, std::uint64_t address,
                               std::uint32_t value) noexcept {
  std::array<unsigned char, 4> b{
      static_cast<unsigned char>(value), static_cast<unsigned char>(value >> 8U),
      static_cast<unsigned char>(value >> 16U), static_cast<unsigned char>(value >> 24U)};
  const int sent = libusb_control_transfer(
      handle, kWriteRequest, kQuadlets, static_cast<std::uint16_t>(address & 0xFFFF),
      static_cast<std::uint16_t>(address >> 16U & 0xFFFF), b.data(), b.size(), limit_ms());
  if (sent < 0) return usb_status(sent);
  return sent == static_cast<int>(b.size()) ? DeviceStatus::ok : DeviceStatus::failed;
}

bool for_each_usb_camera(libusb_context* context, std::string* message,
                         const std::function<bool(FoundUsbCamera*)>& look) {
  libusb_device** list = nullptr;
  const ssize_t n = libusb_get_device_list(context, &list);
  if (n < 0) {
    *message = kNoUsb;
    return false;
  }
  bool done = false;
  for (ssize_t i = 0; i < n && !done; ++i) {
    libusb_device_descriptor d{};
    if (libusb_get_device_descriptor(list[i], &d) != LIBUSB_SUCCESS) continue;
    const Product* product = product_of(d);
    if (product == nullptr) continue;
    FoundUsbCamera found = ask(list[i], d, *product, message);
    done = look(&found);
    if (found.handle != nullptr) libusb_close(found.handle);
  }
  libusb_free_device_list(list, 1);
  return true;
}

std::vector<UsbCandidate> find_usb_cameras(std::string* message) {
  std::vector<UsbCandidate> all;
  libusb_context* context = nullptr;
  if (libusb_init(&context) != LIBUSB_SUCCESS) {
    *message = kNoUsb;
    return all;
  }
  (void)for_each_usb_camera(context, message, [&all](FoundUsbCamera* found) {
    all.push_back(std::move(found->who));
    return false;
  });
  libusb_exit(context);
  // By GUID, those that do not tell theirs last: the order in which ports were found changes from
  // one start to the next.
  std::sort(all.begin(), all.end(), [](const UsbCandidate& a, const UsbCandidate& b) {
    return std::pair(a.guid == 0, a.guid) < std::pair(b.guid == 0, b.guid);
  });
  return all;
}

}  // namespace vergence::iidc
