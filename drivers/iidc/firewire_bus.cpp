#include "drivers/iidc/firewire_bus.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <map>
#include <mutex>

#include "drivers/clock.hpp"
#include "drivers/iidc/camera_registers.hpp"
#include "drivers/iidc/identity.hpp"
#include "drivers/iidc/iidc.hpp"
#include "drivers/iidc/iidc_camera.hpp"

namespace vergence::iidc {
namespace {

// A register access that takes longer has met the kernel's split timeout.
constexpr Duration kSlow = Duration::milliseconds(90);

constexpr const char* kNoStack = "this kernel has no FireWire stack; run modprobe firewire-ohci";

DeviceInfo to_device_info(const FirewireNode& node) {
  return {"iidc-1394", guid_text(node.rom.guid),
          node.rom.model[0] != 0 ? node.rom.model.data() : "IIDC camera", node.device};
}

/// Disables libdc1394's messages on stderr; status and last_error() replace them.
void silence_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    for (const dc1394log_t level : {DC1394_LOG_ERROR, DC1394_LOG_WARNING, DC1394_LOG_DEBUG})
      (void)dc1394_log_register_handler(level, nullptr, nullptr);
  });
}

}  // namespace

std::unique_ptr<FirewireBus> FirewireBus::open(std::string_view requested, DeviceStatus* status,
                                               std::string* message) {
  std::unique_ptr<FirewireBus> bus(new FirewireBus);
  *status = bus->open_node(requested);
  if (*status == DeviceStatus::ok) return bus;
  *message = bus->last_error_;
  return nullptr;
}

DeviceStatus FirewireBus::open_node(std::string_view requested) {
  silence_library();
  last_error_.clear();
  DeviceStatus status = DeviceStatus::not_found;
  if (!has_firewire()) last_error_ = kNoStack;
  for (const FirewireNode& node : list_firewire_cameras()) {
    if (!names_camera(requested, node.rom.guid)) continue;
    lock_ = ::open(node.device.c_str(), O_RDWR | O_CLOEXEC);
    if (lock_ < 0) {
      status =
          errno == EACCES || errno == EPERM ? DeviceStatus::no_permission : DeviceStatus::failed;
      last_error_ =
          "no access to " + node.device + ": " + std::strerror(errno) +
          "; install the udev rules (vergence devices --write-udev), and be in group video";
      if (!requested.empty()) return status;
      continue;
    }
    // The kernel admits any number of programs to a camera; two that stream would corrupt each
    // other's registers.
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
      status = DeviceStatus::busy;
      last_error_ = node.device + " is locked";
      (void)::close(lock_);
      lock_ = -1;
      if (!requested.empty()) return status;
      continue;
    }
    library_ = dc1394_new();
    camera_ = library_ != nullptr ? dc1394_camera_new(library_, node.rom.guid) : nullptr;
    if (camera_ == nullptr) {
      close_node();
      status = DeviceStatus::failed;
      last_error_ = "libdc1394 cannot open " + node.device;
      if (!requested.empty()) return status;
      continue;
    }
    node_ = node;
    info_ = to_device_info(node);
    last_error_.clear();
    return DeviceStatus::ok;
  }
  return status;
}

void FirewireBus::close_node() noexcept {
  if (camera_ != nullptr) dc1394_camera_free(camera_);
  if (library_ != nullptr) dc1394_free(library_);
  if (lock_ >= 0) (void)::close(lock_);
  camera_ = nullptr;
  library_ = nullptr;
  lock_ = -1;
}

FirewireBus::~FirewireBus() {
  stop();
  // By contract the consumer no longer uses images.
  ring_.discard_kept();
  end_ring();
  close_node();
  if (wake_ >= 0) (void)::close(wake_);
}

/// A camera given up while its node exists (silent, misaligned) still captures while an image is
/// held; close_node() would free the memory in use.
void FirewireBus::end_capture() noexcept {
  if (ring_.any_kept()) {
    ring_.abandon();
  } else {
    end_ring();
  }
}

DeviceStatus FirewireBus::reopen() noexcept {
  try {
    end_capture();
    ring_.drop_orphans();
    if (!ring_.has_room()) {
      last_error_ = "images from before it was disconnected are still in use";
      return DeviceStatus::disconnected;
    }
    close_node();
    const std::string mine = info_.serial;
    const DeviceStatus status = open_node(mine);
    if (status != DeviceStatus::ok) {
      if (last_error_.empty())
        last_error_ = "the camera is not on the bus; check its cable and power";
      return status == DeviceStatus::no_permission || status == DeviceStatus::busy
                 ? status
                 : DeviceStatus::disconnected;
    }
    ring_.use_free_range();
    lost_.store(false, std::memory_order_release);
    return status;
  } catch (const std::exception&) {
    return DeviceStatus::disconnected;
  }
}

// ---- registers

/// Derives the status from the duration, because libdc1394 reports only a failure.
DeviceStatus FirewireBus::failure(HostStamp begun) const noexcept {
  if (::access(node_.device.c_str(), F_OK) != 0) return DeviceStatus::disconnected;
  return monotonic_now() - begun > kSlow ? DeviceStatus::timeout : DeviceStatus::unsupported;
}

DeviceStatus FirewireBus::read(std::uint64_t address, std::uint32_t* value) noexcept {
  if (camera_ == nullptr) return DeviceStatus::disconnected;
  const HostStamp begun = monotonic_now();
  return dc1394_get_registers(camera_, address - kRegisterSpace, value, 1) == DC1394_SUCCESS
             ? DeviceStatus::ok
             : failure(begun);
}

DeviceStatus FirewireBus::write(std::uint64_t address, std::uint32_t value) noexcept {
  if (camera_ == nullptr) return DeviceStatus::disconnected;
  const HostStamp begun = monotonic_now();
  return dc1394_set_registers(camera_, address - kRegisterSpace, &value, 1) == DC1394_SUCCESS
             ? DeviceStatus::ok
             : failure(begun);
}

// ---- the ring

/// Precondition: no slot of the ring is kept.
void FirewireBus::end_ring() noexcept {
  if (lost_.load(std::memory_order_acquire)) {
    ring_.abandon();
  } else {
    ring_.end();
  }
}

DeviceStatus FirewireBus::allocate(const StreamShape& shape) noexcept {
  end_ring();
  ring_.set_shape(shape);
  return DeviceStatus::ok;
}

void FirewireBus::give_back(FrameSlot slot) noexcept {
  if (ring_.give_back(slot) && wake_ >= 0) (void)!::write(wake_, "\1\0\0\0\0\0\0", 8);
}

namespace {

class FirewireDriver final : public CameraDriver {
 public:
  std::vector<DeviceInfo> enumerate() override {
    last_error_ = has_firewire() ? "" : kNoStack;
    std::vector<DeviceInfo> out;
    for (const FirewireNode& n : list_firewire_cameras()) out.push_back(to_device_info(n));
    return out;
  }
  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    last_error_.clear();
    auto bus = FirewireBus::open(serial, status, &last_error_);
    if (bus == nullptr) return nullptr;
    const ConfigRom rom = bus->rom();
    auto& clock = clocks_[bus->bus()];
    if (clock == nullptr) clock = std::make_shared<SharedClock>();
    return std::make_unique<IidcCamera>(std::move(bus), rom, clock);
  }
  std::string last_error() const override { return last_error_; }

 private:
  // Clocks by bus name.
  std::map<std::string, std::shared_ptr<SharedClock>> clocks_;
  std::string last_error_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_1394_driver() { return std::make_unique<FirewireDriver>(); }

}  // namespace vergence::iidc
