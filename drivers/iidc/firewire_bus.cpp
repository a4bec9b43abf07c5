#include "drivers/iidc/firewire_bus.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <mutex>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/iidc/budget_words.hpp"
#include "drivers/iidc/camera_registers.hpp"
#include "drivers/iidc/identity.hpp"

namespace vergence::iidc {
namespace {

constexpr int kLookMs = 100;  // a thread that polls looks up at least so often
constexpr Duration kSlow = Duration::milliseconds(
    90);  // a register access that takes longer met the kernel's split time-out

/// libdc1394 writes to stderr unless told otherwise; what matters is said by status and sentence.
void silence_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    for (const dc1394log_t level : {DC1394_LOG_ERROR, DC1394_LOG_WARNING, DC1394_LOG_DEBUG})
      (void)dc1394_log_register_handler(level, nullptr, nullptr);
  });
}

std::int64_t realtime_us() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_REALTIME, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000 + t.tv_nsec / 1000;
}

}  // namespace

// ---- finding and opening

std::unique_ptr<FirewireBus> FirewireBus::open(std::string_view requested,
                                               std::shared_ptr<BusLedger> ledger,
                                               DeviceStatus* status, std::string* message) {
  std::unique_ptr<FirewireBus> bus(new FirewireBus);
  bus->ledger_ = std::move(ledger);
  *status = bus->open_node(requested);
  if (*status == DeviceStatus::ok) return bus;
  *message = bus->last_error_;
  return nullptr;
}

DeviceStatus FirewireBus::open_node(std::string_view requested) {
  silence_library();
  last_error_.clear();
  DeviceStatus status = DeviceStatus::not_found;
  if (!has_firewire()) last_error_ = "this kernel has no FireWire stack: modprobe firewire-ohci";
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
    // The kernel lets any number of programs at a camera; two that stream would spoil each other's
    // registers.
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
    info_ = {"iidc-1394", guid_text(node.rom.guid),
             node.rom.model[0] != 0 ? node.rom.model.data() : "IIDC camera", node.device};
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
  tear_down();
  close_node();
  kept_.clear();  // the consumer is gone by contract
  drop_orphan();
  if (wake_ >= 0) (void)::close(wake_);
  ledger_->remove(this);
}

DeviceStatus FirewireBus::reopen() noexcept {
  try {
    drop_orphan();
    const std::size_t other = 1 - generation_.load(std::memory_order_relaxed);
    if (map().base != nullptr && maps_[other].base != nullptr) {
      last_error_ = "images of before it was unplugged are still in use";
      return DeviceStatus::gone;
    }
    close_node();
    const std::string mine = info_.serial;
    const DeviceStatus status = open_node(mine);
    if (status != DeviceStatus::ok) {
      if (last_error_.empty()) last_error_ = "the camera is not on the bus";
      return status == DeviceStatus::no_permission || status == DeviceStatus::busy
                 ? status
                 : DeviceStatus::gone;
    }
    if (map().base != nullptr) generation_.store(other, std::memory_order_release);
    lost_.store(false, std::memory_order_release);
    return status;
  } catch (const std::exception&) {
    return DeviceStatus::gone;
  }
}

// ---- registers

/// libdc1394 says only that it failed.
DeviceStatus FirewireBus::failure(HostStamp begun) const noexcept {
  if (::access(node_.device.c_str(), F_OK) != 0) return DeviceStatus::gone;
  return monotonic_now() - begun > kSlow ? DeviceStatus::timeout : DeviceStatus::unsupported;
}

DeviceStatus FirewireBus::read(std::uint64_t address, std::uint32_t* value) noexcept {
  if (camera_ == nullptr) return DeviceStatus::gone;
  const HostStamp begun = monotonic_now();
  return dc1394_get_registers(camera_, address - kRegisterSpace, value, 1) == DC1394_SUCCESS
             ? DeviceStatus::ok
             : failure(begun);
}

DeviceStatus FirewireBus::write(std::uint64_t address, std::uint32_t value) noexcept {
  if (camera_ == nullptr) return DeviceStatus::gone;
  const HostStamp begun = monotonic_now();
  return dc1394_set_registers(camera_, address - kRegisterSpace, &value, 1) == DC1394_SUCCESS
             ? DeviceStatus::ok
             : failure(begun);
}

// ---- the ring

DeviceStatus FirewireBus::allocate(const StreamShape& shape) noexcept {
  tear_down();
  shape_ = shape;
  try {
    ledger_->put(this, node_.bus, {shape.packet_bytes, shape.speed, shape.image_bytes});
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
  return DeviceStatus::ok;
}

DeviceStatus FirewireBus::set_up() {
  last_error_ = ledger_->last_error(node_.bus);
  if (!last_error_.empty()) return DeviceStatus::no_bandwidth;
  const dc1394error_t error = dc1394_capture_setup(
      camera_, static_cast<std::uint32_t>(shape_.buffers), DC1394_CAPTURE_FLAGS_DEFAULT);
  if (error == DC1394_NO_BANDWIDTH || error == DC1394_NO_ISO_CHANNEL) {
    last_error_ = "the bus has no room left for its " +
                  std::to_string(bandwidth_units(shape_.packet_bytes, shape_.speed)) +
                  " bandwidth units, or no channel: another program streams on it";
    return DeviceStatus::no_bandwidth;
  }
  if (error != DC1394_SUCCESS) {
    last_error_ =
        std::string("libdc1394 cannot set up the capture: ") + dc1394_error_get_string(error);
    return ::access(node_.device.c_str(), F_OK) != 0 ? DeviceStatus::gone : DeviceStatus::failed;
  }
  captured_ = true;
  if (!find_map()) {
    last_error_ = "the capture's memory is not where libdc1394 2.2 puts it";
    tear_down();
    return DeviceStatus::failed;
  }
  queue_first_ = 0;
  queued_ = shape_.buffers;
  for (std::size_t i = 0; i < queued_; ++i) queue_[i] = static_cast<std::uint8_t>(i);
  (void)returned_.take_all();
  return DeviceStatus::ok;
}

/// The library tells where its ring is only with the first frame; an unplug may come before.
bool FirewireBus::find_map() {
  std::ifstream maps("/proc/self/maps");
  const std::uint8_t* known = maps_[1 - generation_.load(std::memory_order_relaxed)].base;
  for (std::string line; std::getline(maps, line);) {
    if (!line.ends_with(node_.device)) continue;
    std::uintptr_t first = 0, last = 0;
    if (std::sscanf(line.c_str(), "%" SCNxPTR "-%" SCNxPTR, &first, &last) != 2) continue;
    auto* base = reinterpret_cast<std::uint8_t*>(first);
    if (base == known || last - first < shape_.buffers * shape_.frame_bytes) continue;
    map() = {base, last - first, shape_.frame_bytes};
    return true;
  }
  return false;
}

/// Ends a capture whose node is there. Precondition: no slot of it is kept.
void FirewireBus::tear_down() noexcept {
  if (!captured_) return;
  if (lost_.load(std::memory_order_acquire) || dc1394_capture_stop(camera_) != DC1394_SUCCESS)
    return abandon();
  captured_ = false;
  map() = {};
}

/// Ends a capture whose node is gone, as far as nobody looks at its images.
void FirewireBus::abandon() noexcept {
  if (!captured_) return;
  captured_ = false;
  const int fd = dc1394_capture_get_fileno(camera_);
  if (fd >= 0) (void)::close(fd);
  drop_orphan();
}

/// Unmaps what is left of captures that ended, once nothing in it is kept.
void FirewireBus::drop_orphan() noexcept {
  for (std::size_t g = 0; g < maps_.size(); ++g) {
    const bool in_use = captured_ && g == generation_.load(std::memory_order_relaxed);
    if (maps_[g].base == nullptr || in_use || kept_in(g) != 0) continue;
    (void)::munmap(maps_[g].base, maps_[g].length);
    maps_[g] = {};
  }
}

const std::uint8_t* FirewireBus::bytes(FrameSlot slot) const noexcept {
  const Map& m = maps_[slot / kMaxBuffers];
  return m.base + slot % kMaxBuffers * m.stride;
}

void FirewireBus::give_back(FrameSlot slot) noexcept {
  const bool current = slot / kMaxBuffers == generation_.load(std::memory_order_acquire);
  if (current)
    returned_.put(
        slot);  // before it leaves kept_: an owner that sees none kept finds all of them here
  (void)kept_.remove(slot);
  if (current && wake_ >= 0) (void)!::write(wake_, "\1\0\0\0\0\0\0", 8);
}

void FirewireBus::enqueue(std::size_t buffer) noexcept {
  dc1394video_frame_t frame{};  // the library looks at these two only
  frame.camera = camera_;
  frame.id = static_cast<std::uint32_t>(buffer);
  if (dc1394_capture_enqueue(camera_, &frame) != DC1394_SUCCESS)
    return;  // gone: told by the next poll
  queue_[(queue_first_ + queued_++) % queue_.size()] = static_cast<std::uint8_t>(buffer);
}

void FirewireBus::enqueue_returned() noexcept {
  const std::uint64_t all = returned_.take_all();
  // Of this ring only: a slot of the one before may have come back while it was replaced.
  std::uint64_t bits =
      all >> generation_.load(std::memory_order_relaxed) * kMaxBuffers & 0xFFFF'FFFFU;
  for (; bits != 0; bits &= bits - 1) enqueue(static_cast<std::size_t>(std::countr_zero(bits)));
}

// ---- streaming

DeviceStatus FirewireBus::start(StreamSink* sink) noexcept {
  stop();
  if (camera_ == nullptr) return DeviceStatus::gone;
  try {
    if (wake_ < 0) wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (captured_ && kept_in(generation_.load(std::memory_order_relaxed)) == 0) tear_down();
    if (captured_) {
      resume();
    } else if (const DeviceStatus status = set_up(); status != DeviceStatus::ok) {
      return status;
    }
    sink_ = sink;
    stopping_.store(false, std::memory_order_release);
    thread_ = std::thread([this] { stream(); });
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

/// Goes on with a ring of which images are still held: what came meanwhile goes back.
void FirewireBus::resume() noexcept {
  enqueue_returned();
  for (std::size_t i = 0; i < kMaxBuffers; ++i) {
    dc1394video_frame_t* frame = nullptr;
    if (dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, &frame) != DC1394_SUCCESS ||
        frame == nullptr || queued_ == 0)
      return;
    const std::size_t buffer = queue_[queue_first_];
    queue_first_ = (queue_first_ + 1) % queue_.size();
    --queued_;
    enqueue(buffer);
  }
}

void FirewireBus::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) {
    (void)!::write(wake_, "\1\0\0\0\0\0\0", 8);
    thread_.join();
  }
  sink_ = nullptr;
  if (lost_.load(std::memory_order_acquire)) {
    abandon();
  } else if (captured_ && kept_in(generation_.load(std::memory_order_relaxed)) == 0) {
    tear_down();
  }
  drop_orphan();
}

void FirewireBus::stream() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-iidc13");
  const int fd = dc1394_capture_get_fileno(camera_);
  while (!stopping_.load(std::memory_order_acquire)) {
    std::array<pollfd, 2> fds{pollfd{fd, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    if (::poll(fds.data(), fds.size(), kLookMs) < 0 && errno != EINTR) break;
    if (fds[1].revents != 0) {
      std::uint64_t rung = 0;
      (void)!::read(wake_, &rung, sizeof rung);
    }
    enqueue_returned();
    if (fds[0].revents != 0 && !take_one()) break;
  }
  if (stopping_.load(std::memory_order_acquire)) return;
  lost_.store(true, std::memory_order_release);
  sink_->gone(monotonic_now());
}

/// False: the device is gone.
bool FirewireBus::take_one() noexcept {
  dc1394video_frame_t* frame = nullptr;
  if (dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, &frame) != DC1394_SUCCESS)
    return false;
  if (frame == nullptr) return true;  // a bus reset, or nothing
  if (queued_ == 0) return true;      // cannot be: the kernel filled what it did not have
  const std::size_t buffer = queue_[queue_first_];
  queue_first_ = (queue_first_ + 1) % queue_.size();
  --queued_;
  Arrival a;
  a.slot = slot_of(buffer);
  a.data = bytes(a.slot);
  a.bytes = shape_.frame_bytes;
  a.at = monotonic_now();
  a.broken = frame->total_bytes != shape_.frame_bytes;
  a.spare = queued_ >= kReserve;
  if (frame->timestamp != 0) {
    a.has_bus_stamp = true;
    a.bus_stamp =
        a.at - Duration::microseconds(realtime_us() - static_cast<std::int64_t>(frame->timestamp));
  }
  kept_.put(a.slot);
  if (!sink_->frame(a)) {
    (void)kept_.remove(a.slot);
    enqueue(buffer);
  }
  return true;
}

std::string FirewireBus::remark(const StreamShape& shape, double, int sharing) const {
  const std::vector<BusShare> shares(static_cast<std::size_t>(std::max(sharing, 1)),
                                     {shape.packet_bytes, shape.speed, shape.image_bytes});
  const std::string text = budget_error(shares);
  return text.empty() ? text : "if all are on one bus, " + text;
}

}  // namespace vergence::iidc
