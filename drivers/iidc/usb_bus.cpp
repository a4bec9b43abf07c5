#include "drivers/iidc/usb_bus.hpp"

#include <pthread.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <exception>
#include <functional>
#include <new>
#include <utility>

#include "drivers/clock.hpp"
#include "drivers/format_text.hpp"
#include "drivers/iidc/camera_registers.hpp"
#include "drivers/iidc/identity.hpp"
#include "drivers/iidc/iidc.hpp"
#include "drivers/iidc/iidc_camera.hpp"

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

// Vendor requests to the device.
constexpr unsigned char kReadRequest = 0xC0, kWriteRequest = 0x40;
// Stands for addresses 0xFFFF….
constexpr unsigned char kQuadlets = 0x7F;
unsigned limit_ms() noexcept { return static_cast<unsigned>(kUsbRegisterLimit.ns() / 1'000'000); }

const Product* find_product(const libusb_device_descriptor& d) noexcept {
  if (d.idVendor != kPointGrey) return nullptr;
  for (const Product& p : kProducts)
    if (p.id == d.idProduct) return &p;
  return nullptr;
}

std::string place_of(libusb_device* device) {
  return format_text("usb %03d/%03d", libusb_get_bus_number(device),
                     libusb_get_device_address(device));
}

std::string node_of(libusb_device* device) {
  return format_text("/dev/bus/usb/%03d/%03d", libusb_get_bus_number(device),
                     libusb_get_device_address(device));
}

DeviceStatus usb_status(int libusb_error) noexcept {
  switch (libusb_error) {
    case LIBUSB_SUCCESS:
      return DeviceStatus::ok;
    case LIBUSB_ERROR_TIMEOUT:
      return DeviceStatus::timeout;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return DeviceStatus::disconnected;
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

/// Registers of a device that is open but not yet used as a camera.
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

/// Attached device that may be an IIDC camera.
struct UsbCandidate {
  // Its `serial` is the GUID; empty if the device could not be opened.
  DeviceInfo info{};
  // Serial number of the USB descriptor.
  std::string transport_serial;
  std::uint64_t guid = 0;
  // Reason why the device could not be queried.
  DeviceStatus access = DeviceStatus::ok;
};

/// Device under inspection; `handle` is null if `who.access` is not ok.
struct FoundUsbCamera {
  UsbCandidate who;
  ConfigRom rom;
  libusb_device* device = nullptr;
  libusb_device_handle* handle = nullptr;
};

constexpr const char* kNoUsb = "the system's USB devices cannot be listed";

/// Opens a device and reads its identity.
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
                 "; install the udev rules (vergence devices --write-udev) and reconnect it";
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

/// Opens each device in turn and passes it to the callback, which returns true to end the search. A
/// handle that the callback does not take (set to null) is closed. Returns false if devices cannot
/// be listed.
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
    const Product* product = find_product(d);
    if (product == nullptr) continue;
    FoundUsbCamera found = ask(list[i], d, *product, message);
    done = look(&found);
    if (found.handle != nullptr) libusb_close(found.handle);
  }
  libusb_free_device_list(list, 1);
  return true;
}

/// Every device with a known id, sorted by GUID.
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
  // Sorts by GUID, unknown ones last, because the order of ports changes between starts.
  std::sort(all.begin(), all.end(), [](const UsbCandidate& a, const UsbCandidate& b) {
    return std::pair(a.guid == 0, a.guid) < std::pair(b.guid == 0, b.guid);
  });
  return all;
}

// Consecutive failed transfers after which the device counts as disconnected.
constexpr int kMaxErrors = 8;
// Transfers of USB 3 are multiples of this packet size, in bytes.
constexpr std::size_t kSuperSpeedBlock = 1024;

}  // namespace

// ---- opening

std::unique_ptr<UsbBus> UsbBus::open(std::string_view requested, DeviceStatus* status,
                                     std::string* message) {
  std::unique_ptr<UsbBus> bus(new UsbBus);
  *status = bus->open_device(requested);
  if (*status == DeviceStatus::ok) return bus;
  *message = bus->last_error_;
  return nullptr;
}

DeviceStatus UsbBus::open_device(std::string_view requested) {
  last_error_.clear();
  // Uses a new context, because without a udev daemon libusb updates its device list only when a
  // context is created.
  if (libusb_init(&context_) != LIBUSB_SUCCESS) {
    context_ = nullptr;
    last_error_ = kNoUsb;
    return DeviceStatus::failed;
  }
  DeviceStatus status = DeviceStatus::not_found;
  const bool listed = for_each_usb_camera(context_, &last_error_, [&](FoundUsbCamera* found) {
    // This may be the requested camera.
    if (found->handle == nullptr) {
      if (status == DeviceStatus::not_found && found->who.access == DeviceStatus::no_permission)
        status = found->who.access;
      return false;
    }
    if (!names_camera(requested, found->who.guid, found->who.transport_serial)) return false;
    status = claim(found->handle);
    // Without a requested name any other camera will do.
    if (status != DeviceStatus::ok) return !requested.empty();
    handle_ = std::exchange(found->handle, nullptr);
    info_ = found->who.info;
    rom_ = found->rom;
    const bool super = libusb_get_device_speed(found->device) >= LIBUSB_SPEED_SUPER;
    traits_ = {false, BusSpeed::s800, super ? std::size_t{65532} : largest_packet(BusSpeed::s800),
               super ? 400e6 : 53e6};
    last_error_.clear();
    return true;
  });
  if (!listed) status = DeviceStatus::failed;
  if (status != DeviceStatus::ok) close_device();
  return status;
}

DeviceStatus UsbBus::claim(libusb_device_handle* handle) {
  int active = 0;
  // Setting the active configuration again would disturb another program.
  if (libusb_get_configuration(handle, &active) == LIBUSB_SUCCESS && active != 1)
    (void)libusb_set_configuration(handle, 1);
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(libusb_get_device(handle), &config) != LIBUSB_SUCCESS) {
    last_error_ = "its USB configuration cannot be read";
    return DeviceStatus::failed;
  }
  interface_ = -1;
  constexpr unsigned char kImages = 0x81;
  for (int i = 0; i < config->bNumInterfaces && interface_ < 0; ++i) {
    if (config->interface[i].num_altsetting < 1) continue;
    const libusb_interface_descriptor& alt = config->interface[i].altsetting[0];
    for (int e = 0; e < alt.bNumEndpoints; ++e)
      if (alt.endpoint[e].bEndpointAddress == kImages &&
          (alt.endpoint[e].bmAttributes & 3) == LIBUSB_TRANSFER_TYPE_BULK) {
        interface_ = alt.bInterfaceNumber;
        endpoint_ = kImages;
      }
  }
  libusb_free_config_descriptor(config);
  if (interface_ < 0) {
    last_error_ =
        "it has no bulk endpoint 0x81 for images, so it is not an IIDC camera (USB3 Vision is not "
        "supported)";
    return DeviceStatus::failed;
  }
  const int error = libusb_claim_interface(handle, interface_);
  if (error == LIBUSB_SUCCESS) return DeviceStatus::ok;
  last_error_ = error == LIBUSB_ERROR_BUSY ? "another program uses it; end that program"
                                           : libusb_strerror(static_cast<libusb_error>(error));
  return usb_status(error);
}

void UsbBus::close_device() noexcept {
  if (handle_ != nullptr) {
    (void)libusb_release_interface(handle_, interface_);
    libusb_close(handle_);
    handle_ = nullptr;
  }
  if (context_ != nullptr) {
    libusb_exit(context_);
    context_ = nullptr;
  }
}

UsbBus::~UsbBus() {
  stop();
  close_device();
  drop_memory();
}

void UsbBus::drop_memory() noexcept {
  if (given_up_) (void)memory_.release();
  given_up_ = false;
  memory_.reset();
}

DeviceStatus UsbBus::reopen() noexcept {
  try {
    const std::string mine = info_.serial;
    close_device();
    let_go();
    const DeviceStatus status = open_device(mine);
    if (status != DeviceStatus::ok) {
      if (last_error_.empty()) last_error_ = "the camera is not connected; check its cable";
      info_.serial = mine;
      return status == DeviceStatus::no_permission || status == DeviceStatus::busy
                 ? status
                 : DeviceStatus::disconnected;
    }
    lost_.store(false, std::memory_order_release);
    return status;
  } catch (const std::exception&) {
    return DeviceStatus::disconnected;
  }
}

// ---- registers

DeviceStatus UsbBus::read(std::uint64_t address, std::uint32_t* value) noexcept {
  return handle_ == nullptr ? DeviceStatus::disconnected
                            : read_usb_quadlet(handle_, address, value);
}

DeviceStatus UsbBus::write(std::uint64_t address, std::uint32_t value) noexcept {
  return handle_ == nullptr ? DeviceStatus::disconnected
                            : write_usb_quadlet(handle_, address, value);
}

// ---- streaming

DeviceStatus UsbBus::allocate(const StreamShape& shape) noexcept {
  try {
    const bool super = traits_.largest_packet > largest_packet(BusSpeed::s800);
    // USB 3 sends the image, USB 2 packets with padding.
    transfer_bytes_ =
        super ? (shape.image_bytes + kSuperSpeedBlock - 1) / kSuperSpeedBlock * kSuperSpeedBlock
              : shape.frame_bytes;
    if (abandoned()) {
      if (const DeviceStatus status = reopen(); status != DeviceStatus::ok) return status;
    }
    drop_memory();
    memory_ = std::make_unique<SlotMemory>();
    memory_->allocate(shape.buffers, transfer_bytes_);
    flights_.resize(std::min(kTransfers, shape.buffers - 1));
    shape_ = shape;
    return DeviceStatus::ok;
  } catch (const std::bad_alloc&) {
    last_error_ = "there is not enough memory for its images";
    return DeviceStatus::failed;
  }
}

int UsbBus::submit(Flight* flight) noexcept {
  // No timeout: a camera may be silent, and cancelling ends the transfer.
  libusb_fill_bulk_transfer(flight->transfer, handle_, endpoint_, memory_->bytes(flight->slot),
                            static_cast<int>(transfer_bytes_), &UsbBus::on_transfer, flight, 0);
  flying_.fetch_add(1, std::memory_order_acq_rel);
  flight->flying = true;
  const int error = libusb_submit_transfer(flight->transfer);
  if (error == LIBUSB_SUCCESS) return error;
  flight->flying = false;
  flying_.fetch_sub(1, std::memory_order_acq_rel);
  return error;
}

DeviceStatus UsbBus::start(StreamSink* sink) noexcept {
  if (handle_ == nullptr) return DeviceStatus::disconnected;
  stop();
  if (abandoned()) return DeviceStatus::disconnected;
  // Corrects the count: an abandoned transfer that returned was subtracted twice.
  flying_.store(0, std::memory_order_release);
  sink_ = sink;
  errors_ = 0;
  stopping_.store(false, std::memory_order_release);
  lost_.store(false, std::memory_order_release);
  // Clears a halt left by an earlier program.
  (void)libusb_clear_halt(handle_, endpoint_);
  int error = LIBUSB_SUCCESS;
  for (Flight& f : flights_) {
    const auto slot = memory_->acquire();
    // The consumer holds all other slots.
    if (!slot) {
      error = LIBUSB_ERROR_NO_MEM;
      break;
    }
    f = {this, libusb_alloc_transfer(0), *slot, false};
    error = f.transfer == nullptr ? LIBUSB_ERROR_NO_MEM : submit(&f);
    if (error != LIBUSB_SUCCESS) break;
  }
  if (error == LIBUSB_SUCCESS) {
    try {
      thread_ = std::thread([this] { handle_events(); });
      return DeviceStatus::ok;
    } catch (const std::exception&) {
      error = LIBUSB_ERROR_OTHER;
    }
  }
  stop();
  if (error == LIBUSB_ERROR_NO_DEVICE) return DeviceStatus::disconnected;
  last_error_ = error == LIBUSB_ERROR_OTHER
                    ? "the thread of its stream cannot be started"
                    : "the kernel's USB memory is exhausted; raise its limit (16 MB for all "
                      "devices) with echo 256 > /sys/module/usbcore/parameters/usbfs_memory_mb";
  return error == LIBUSB_ERROR_OTHER ? DeviceStatus::failed : DeviceStatus::no_bandwidth;
}

void UsbBus::on_transfer(libusb_transfer* transfer) {
  auto* flight = static_cast<Flight*>(transfer->user_data);
  flight->bus->completed(flight);
}

/// Handles a returned transfer. If it is not submitted again, it keeps its slot until stop(),
/// because the owner may be cancelling it.
void UsbBus::completed(Flight* flight) noexcept {
  bool again = !stopping_.load(std::memory_order_acquire) && !lost_.load(std::memory_order_acquire);
  if (again) {
    switch (flight->transfer->status) {
      case LIBUSB_TRANSFER_COMPLETED:
      case LIBUSB_TRANSFER_OVERFLOW:  // more than a frame: its end was lost
        errors_ = 0;
        filled(flight);
        break;
      case LIBUSB_TRANSFER_NO_DEVICE:
        again = false;
        break;
      default:  // error, stall, or cancelled from outside
        again = ++errors_ < kMaxErrors;
        break;
    }
    again = again && submit(flight) == LIBUSB_SUCCESS;
    if (!again) lose();
  }
  if (!again) flight->flying = false;
  // Must be last: afterwards stop() may free the flight.
  flying_.fetch_sub(1, std::memory_order_acq_rel);
}

void UsbBus::filled(Flight* flight) noexcept {
  const auto next = memory_->acquire();
  Arrival a;
  a.slot = flight->slot;
  a.data = memory_->bytes(flight->slot);
  a.bytes = static_cast<std::size_t>(std::max(flight->transfer->actual_length, 0));
  a.at = monotonic_now();
  a.broken = flight->transfer->status == LIBUSB_TRANSFER_OVERFLOW;
  a.spare = next.has_value();
  const bool kept = sink_->frame(a);
  if (kept && next) {
    flight->slot = *next;
  } else if (next) {
    memory_->release(*next);
  }
}

/// Releases the slot of a transfer that is no longer in flight. Owner's thread.
void UsbBus::land(Flight* flight) noexcept {
  if (flight->bus == nullptr) return;
  memory_->release(flight->slot);
  libusb_free_transfer(flight->transfer);
  *flight = {};
}

/// True if libusb still has abandoned transfers of the previous stream, which may return and access
/// their flights.
bool UsbBus::abandoned() const noexcept {
  return std::any_of(flights_.begin(), flights_.end(), [](const Flight& f) { return f.flying; });
}

/// Called when the device is closed and the kernel has no transfers. Abandoned transfers are not
/// freed, because libusb may still use them.
void UsbBus::let_go() noexcept {
  for (Flight& f : flights_) {
    if (!f.flying) continue;
    memory_->release(f.slot);
    f = {};
  }
}

void UsbBus::lose() noexcept {
  if (lost_.exchange(true, std::memory_order_acq_rel) || stopping_.load(std::memory_order_acquire))
    return;
  sink_->disconnected(monotonic_now());
}

void UsbBus::handle_events() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-iidcus");
  while (flying_.load(std::memory_order_acquire) > 0) {
    timeval limit{0, 100'000};
    const int error = libusb_handle_events_timeout_completed(context_, &limit, nullptr);
    if (error == LIBUSB_ERROR_NO_DEVICE) lose();
    if (stopping_.load(std::memory_order_acquire) && error != LIBUSB_SUCCESS &&
        error != LIBUSB_ERROR_INTERRUPTED)
      break;
  }
}

void UsbBus::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  const HostStamp end = monotonic_now() + kCancelLimit;
  // Cancels again while any is in flight: a transfer may have been between its callback and its
  // next submission.
  while (flying_.load(std::memory_order_acquire) > 0 && monotonic_now() < end) {
    for (Flight& f : flights_)
      if (f.transfer != nullptr) (void)libusb_cancel_transfer(f.transfer);
    timeval limit{0, 20'000};
    (void)libusb_handle_events_timeout_completed(context_, &limit, nullptr);
  }
  if (flying_.load(std::memory_order_acquire) > 0) {
    // The host controller does not return these transfers; their memory is kept until the program
    // ends.
    given_up_ = true;
    flying_.store(0, std::memory_order_release);
  }
  if (context_ != nullptr && thread_.joinable()) libusb_interrupt_event_handler(context_);
  if (thread_.joinable()) thread_.join();
  for (Flight& f : flights_)
    if (!f.flying) land(&f);
  sink_ = nullptr;
}

namespace {

class UsbDriver final : public CameraDriver {
 public:
  std::vector<DeviceInfo> enumerate() override {
    last_error_.clear();
    std::vector<DeviceInfo> out;
    for (UsbCandidate& c : find_usb_cameras(&last_error_)) out.push_back(std::move(c.info));
    return out;
  }
  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    last_error_.clear();
    auto bus = UsbBus::open(serial, status, &last_error_);
    if (bus == nullptr) return nullptr;
    const ConfigRom rom = bus->rom();
    return std::make_unique<IidcCamera>(std::move(bus), rom, nullptr);
  }
  std::string last_error() const override { return last_error_; }

 private:
  std::string last_error_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_usb_driver() { return std::make_unique<UsbDriver>(); }

}  // namespace vergence::iidc
