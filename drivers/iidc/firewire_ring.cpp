#include "drivers/iidc/firewire_ring.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <bit>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "firmware_iface/iidc/bandwidth.hpp"

namespace vergence::iidc {

FirewireRing::~FirewireRing() {
  end();
  discard_kept();
  drop_orphans();
}

DeviceStatus FirewireRing::set_up(dc1394camera_t* camera, const std::string& device,
                                  std::string* error) {
  camera_ = camera;
  const dc1394error_t result = dc1394_capture_setup(
      camera_, static_cast<std::uint32_t>(shape_.buffers), DC1394_CAPTURE_FLAGS_DEFAULT);
  if (result == DC1394_NO_BANDWIDTH || result == DC1394_NO_ISO_CHANNEL) {
    *error = "the bus has no bandwidth left for its " +
             std::to_string(bandwidth_units(shape_.packet_bytes, shape_.speed)) +
             " of 4915 bandwidth units, or no channel; lower the rate or the image size, use S800 "
             "or a second bus, or end other programs that stream on it";
    return DeviceStatus::no_bandwidth;
  }
  if (result != DC1394_SUCCESS) {
    *error = std::string("libdc1394 cannot set up the capture: ") + dc1394_error_get_string(result);
    return ::access(device.c_str(), F_OK) != 0 ? DeviceStatus::disconnected : DeviceStatus::failed;
  }
  captured_ = true;
  if (!find_map(device)) {
    *error = "the capture buffers do not match libdc1394 2.2; install that version";
    end();
    return DeviceStatus::failed;
  }
  queue_first_ = 0;
  queued_ = shape_.buffers;
  for (std::size_t i = 0; i < queued_; ++i) queue_[i] = static_cast<std::uint8_t>(i);
  (void)returned_.pop_all();
  return DeviceStatus::ok;
}

/// The library reveals the ring's address only with the first frame, and a disconnect may come
/// first.
bool FirewireRing::find_map(const std::string& device) {
  std::ifstream maps("/proc/self/maps");
  const std::uint8_t* known = maps_[1 - generation()].base;
  for (std::string line; std::getline(maps, line);) {
    if (!line.ends_with(device)) continue;
    std::uintptr_t first = 0, last = 0;
    // NOLINTNEXTLINE(cert-err34-c): two addresses that the kernel wrote
    if (std::sscanf(line.c_str(), "%" SCNxPTR "-%" SCNxPTR, &first, &last) != 2) continue;
    auto* base = reinterpret_cast<std::uint8_t*>(first);
    if (base == known || last - first < shape_.buffers * shape_.frame_bytes) continue;
    maps_[generation()] = {base, last - first, shape_.frame_bytes};
    return true;
  }
  return false;
}

bool FirewireRing::any_kept() const noexcept { return kept_in(generation()) != 0; }

void FirewireRing::end() noexcept {
  if (!captured_) return;
  if (dc1394_capture_stop(camera_) != DC1394_SUCCESS) return abandon();
  captured_ = false;
  maps_[generation()] = {};
}

/// Moves held images to private memory at the same addresses. While any of the node's file is
/// mapped, the kernel keeps the capture and its channel, which the next capture needs.
void FirewireRing::detach_kept() noexcept {
  const Map& m = maps_[generation()];
  std::uint64_t bits = kept_in(generation());
  if (m.base == nullptr || bits == 0) return;
  void* const own =
      ::mmap(nullptr, m.length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  // The capture then ends when the images are released.
  if (own == MAP_FAILED) return;
  for (; bits != 0; bits &= bits - 1) {
    const auto at = static_cast<std::size_t>(std::countr_zero(bits)) * m.stride;
    std::memcpy(static_cast<std::uint8_t*>(own) + at, m.base + at, m.stride);
  }
  if (::mremap(own, m.length, m.length, MREMAP_MAYMOVE | MREMAP_FIXED, m.base) == MAP_FAILED)
    (void)::munmap(own, m.length);
}

void FirewireRing::abandon() noexcept {
  if (!captured_) return;
  captured_ = false;
  detach_kept();
  const int fd = dc1394_capture_get_fileno(camera_);
  if (fd >= 0) (void)::close(fd);
  drop_orphans();
}

void FirewireRing::drop_orphans() noexcept {
  for (std::size_t g = 0; g < maps_.size(); ++g) {
    const bool in_use = captured_ && g == generation();
    if (maps_[g].base == nullptr || in_use || kept_in(g) != 0) continue;
    (void)::munmap(maps_[g].base, maps_[g].length);
    maps_[g] = {};
  }
}

bool FirewireRing::has_room() const noexcept {
  return maps_[0].base == nullptr || maps_[1].base == nullptr;
}

void FirewireRing::use_free_range() noexcept {
  const std::size_t used = generation();
  if (maps_[used].base != nullptr) generation_.store(1 - used, std::memory_order_release);
}

const std::uint8_t* FirewireRing::bytes(FrameSlot slot) const noexcept {
  const Map& m = maps_[slot / kMaxBuffers];
  return m.base + slot % kMaxBuffers * m.stride;
}

// ---- buffers to the kernel and back

bool FirewireRing::give_back(FrameSlot slot) noexcept {
  const bool current = slot / kMaxBuffers == generation_.load(std::memory_order_acquire);
  // Added before the slot leaves kept_, so that an owner that sees none kept finds all of them
  // here.
  if (current) returned_.put(slot);
  (void)kept_.remove(slot);
  return current;
}

void FirewireRing::enqueue(std::size_t buffer) noexcept {
  // The library reads only these two fields.
  dc1394video_frame_t frame{};
  frame.camera = camera_;
  frame.id = static_cast<std::uint32_t>(buffer);
  // The device is disconnected; the next poll reports it.
  if (dc1394_capture_enqueue(camera_, &frame) != DC1394_SUCCESS) return;
  queue_[(queue_first_ + queued_++) % queue_.size()] = static_cast<std::uint8_t>(buffer);
}

void FirewireRing::enqueue_returned() noexcept {
  const std::uint64_t all = returned_.pop_all();
  // Accepts slots of this ring only: a slot of the previous ring may have been released during the
  // change.
  std::uint64_t bits = all >> generation() * kMaxBuffers & 0xFFFF'FFFFU;
  for (; bits != 0; bits &= bits - 1) enqueue(static_cast<std::size_t>(std::countr_zero(bits)));
}

/// Returns false if the device is disconnected. *frame is null if no buffer is filled.
bool FirewireRing::dequeue(dc1394video_frame_t** frame) noexcept {
  *frame = nullptr;
  return dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, frame) == DC1394_SUCCESS;
}

/// The buffer that was queued first was filled. Precondition: queued_ > 0.
std::size_t FirewireRing::pop_queued() noexcept {
  const std::size_t buffer = queue_[queue_first_];
  queue_first_ = (queue_first_ + 1) % queue_.size();
  --queued_;
  return buffer;
}

void FirewireRing::resume() noexcept {
  enqueue_returned();
  for (std::size_t i = 0; i < kMaxBuffers; ++i) {
    dc1394video_frame_t* frame = nullptr;
    if (!dequeue(&frame) || frame == nullptr || queued_ == 0) return;
    enqueue(pop_queued());
  }
}

FirewireRing::PopResult FirewireRing::pop(Filled* filled) noexcept {
  dc1394video_frame_t* frame = nullptr;
  if (!dequeue(&frame)) return PopResult::disconnected;
  // A bus reset, or no frame.
  if (frame == nullptr) return PopResult::empty;
  // Cannot happen: the kernel would have filled a buffer that was not queued.
  if (queued_ == 0) return PopResult::empty;
  filled->slot = static_cast<FrameSlot>(generation() * kMaxBuffers + pop_queued());
  filled->broken = frame->total_bytes != shape_.frame_bytes;
  filled->spare = queued_ >= kReserve;
  filled->at_us = frame->timestamp;
  kept_.put(filled->slot);
  return PopResult::filled;
}

void FirewireRing::refuse(FrameSlot slot) noexcept {
  (void)kept_.remove(slot);
  enqueue(slot % kMaxBuffers);
}

}  // namespace vergence::iidc
