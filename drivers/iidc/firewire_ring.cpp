#include <dc1394/dc1394.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

#include "drivers/iidc/budget_words.hpp"
#include "drivers/iidc/firewire_bus.hpp"

/// The ring of buffers of an IEEE 1394 camera: set up, given back to the kernel, undone.
namespace vergence::iidc {

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
    // NOLINTNEXTLINE(cert-err34-c): two addresses that the kernel wrote
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

}  // namespace vergence::iidc
