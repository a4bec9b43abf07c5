#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/clock.hpp"
#include "tests/support/detail/gvcp.hpp"
#include "tests/support/gige_camera.hpp"

/// The simulated camera's registers, and the thread that answers for them.
namespace vergence::test {
namespace {

using namespace gige_register;
using namespace gvcp;

constexpr std::uint32_t kFireTest = 1U << 31U;
// Status codes of GVCP.
constexpr std::uint32_t kOk = 0, kNotImplemented = 0x8001, kInvalidParameter = 0x8002,
                        kInvalidAddress = 0x8003, kDenied = 0x8006;

std::uint32_t from_wire16(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(p[0]) << 8U | p[1];
}

}  // namespace

std::uint32_t GigeCamera::word(std::uint32_t address) const {
  return address + 4 <= kMemory ? from_wire(&memory_[address]) : 0;
}

float GigeCamera::real(std::uint32_t address) const { return std::bit_cast<float>(word(address)); }

void GigeCamera::put(std::uint32_t address, std::uint32_t value) {
  for (std::uint32_t i = 0; i < 4; ++i)
    memory_[address + i] = static_cast<std::uint8_t>(value >> (24U - 8U * i));
}

void GigeCamera::put_text(std::uint32_t address, const std::string& text, std::size_t room) {
  std::memcpy(&memory_[address], text.data(), std::min(text.size(), room - 1));
}

/// Sets all registers as after power-on. Precondition: mutex_ held, or no thread yet.
void GigeCamera::reset() {
  std::fill(memory_.begin(), memory_.end(), std::uint8_t{0});
  in_addr own{};
  (void)::inet_pton(AF_INET, options_.address.c_str(), &own);
  put(0x00, 0x00010002);
  // Big endian, UTF-8.
  put(0x04, 0x80000001);
  put(0x08, 0x0000'0200);
  // A hardware address of its own.
  put(0x0C, ntohl(own.s_addr));
  put(0x10, 0x7);
  put(0x14, 0x5);
  put(0x24, ntohl(own.s_addr));
  put(0x34, 0xFF000000);
  put_text(0x48, "Vergence", 32);
  put_text(0x68, "Simulator", 32);
  put_text(0x88, "1", 32);
  put_text(0xA8, "a GigE camera for tests", 48);
  put_text(0xD8, options_.serial, 16);
  const std::string description = gige_description(options_);
  put_text(0x200, fmt::format("Local:simulator.xml;{:X};{:X}", kDescription, description.size()),
           512);
  if (kDescription + description.size() > kMemory)
    throw std::runtime_error("simulated camera: the description is too long");
  std::memcpy(&memory_[kDescription], description.data(), description.size());
  put(0x600, 1);
  put(0x900, 0);
  put(0x904, 1);
  put(0x934, 4U | 2U | 1U);
  // ms.
  put(kHeartbeat, 3000);
  put(kTicksHigh, static_cast<std::uint32_t>(options_.tick_frequency >> 32U));
  put(kTicksLow, static_cast<std::uint32_t>(options_.tick_frequency));
  put(kPacketSize, 1500);
  put(sensor_width, static_cast<std::uint32_t>(options_.sensor_width));
  put(sensor_height, static_cast<std::uint32_t>(options_.sensor_height));
  put(width, static_cast<std::uint32_t>(options_.sensor_width));
  put(height, static_cast<std::uint32_t>(options_.sensor_height));
  put(pixel_format, 0x01080001);
  put(payload_size, payload());
  put(acquisition_mode, 2);
  put(frame_rate, std::bit_cast<std::uint32_t>(10.0F));
  put(exposure_time, std::bit_cast<std::uint32_t>(5000.0F));
  put(trigger_selector, 1);
  put(exposure_mode, 1);
  // On, as many cameras come.
  put(exposure_auto, 2);
  put(gain_auto, 2);
  put(line_selector, 1);
  put(ptp_status, 3);
  acquiring_ = false;
  controller_ = {};
  block_ = options_.first_block;
  pulses_.clear();
}

std::uint32_t GigeCamera::payload() const {
  return word(width) * word(height) * (word(pixel_format) >> 16U & 0xFFU) / 8;
}

void GigeCamera::take_control(bool taken) {
  const std::lock_guard lock(mutex_);
  controller_ = {};
  foreign_ = taken;
  put(kControl, taken ? 2 : 0);
  // As whenever its controller changes.
  acquiring_ = false;
}

void GigeCamera::answer() {
  std::array<std::uint8_t, 2048> bytes{};
  for (;;) {
    std::array<pollfd, 3> fds{{{wake_, POLLIN, 0}, {control_, POLLIN, 0}, {broadcast_, POLLIN, 0}}};
    (void)::poll(fds.data(), fds.size(), 50);
    std::unique_lock lock(mutex_);
    if (quit_) return;
    const bool silent_for_long =
        !foreign_ && word(kControl) != 0 &&
        monotonic_now() - heard_ > Duration::milliseconds(word(kHeartbeat));
    // Its controller is gone.
    if (silent_for_long) {
      put(kControl, 0);
      controller_ = {};
      acquiring_ = false;
    }
    for (const pollfd& p : fds) {
      if (p.fd == wake_ || p.fd < 0 || (p.revents & POLLIN) == 0) continue;
      sockaddr_in from{};
      socklen_t length = sizeof from;
      const ssize_t n = ::recvfrom(p.fd, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                   reinterpret_cast<sockaddr*>(&from), &length);
      if (n >= 8 && powered_) handle(control_, bytes.data(), static_cast<std::size_t>(n), from);
    }
  }
}

bool GigeCamera::may_write(const sockaddr_in& from, std::uint32_t address) const {
  if (foreign_) return false;
  const bool in_control = word(kControl) != 0;
  const bool theirs =
      controller_.sin_port == from.sin_port && controller_.sin_addr.s_addr == from.sin_addr.s_addr;
  return in_control ? theirs : address == kControl;
}

void GigeCamera::handle(int fd, const std::uint8_t* bytes, std::size_t length,
                        const sockaddr_in& from) {
  if (bytes[0] != 0x42) return;
  const bool wants_answer = (bytes[1] & 1U) != 0, extended = (bytes[1] & 0x10U) != 0;
  const std::uint32_t command = from_wire16(bytes + 2), size = from_wire16(bytes + 4),
                      id = from_wire16(bytes + 6);
  const std::uint8_t* payload = bytes + 8;
  if (size > length - 8) return;
  if (controller_.sin_port == from.sin_port && controller_.sin_addr.s_addr == from.sin_addr.s_addr)
    heard_ = monotonic_now();
  Wire body;
  std::uint32_t status = kOk;
  switch (command) {
    // Discovery.
    case 0x02:
      for (std::uint32_t i = 0; i < 0xF8; ++i) body.u8(memory_[i]);
      break;
    // Resend; never answered.
    case 0x40:
      if (size >= 12) {
        std::uint64_t block = from_wire(payload) & 0xFFFFU;
        if (extended && size >= 20)
          block =
              static_cast<std::uint64_t>(from_wire(payload + 12)) << 32U | from_wire(payload + 16);
        sender_.resend(block, from_wire(payload + 4) & (extended ? ~0U : 0xFFFFFFU),
                       from_wire(payload + 8) & (extended ? ~0U : 0xFFFFFFU));
      }
      return;
    // Read registers.
    case 0x80:
      for (std::uint32_t i = 0; i + 4 <= size; i += 4) {
        const std::uint32_t address = from_wire(payload + i);
        if (address + 4 > kMemory) status = kInvalidAddress;
        body.u32(word(address));
      }
      break;
    // Write registers.
    case 0x82:
      status = write_registers(payload, size, from);
      body.u16(0).u16(status == kOk ? size / 8 : 0);
      break;
    // Read memory.
    case 0x84: {
      const std::uint32_t address = from_wire(payload), count = from_wire16(payload + 6);
      if (size < 8 || address > kMemory || count > 536 || address + count > kMemory) {
        status = kInvalidAddress;
        break;
      }
      body.u32(address);
      for (std::uint32_t i = 0; i < count; ++i) body.u8(memory_[address + i]);
      break;
    }
    // Write memory: registers in a row.
    case 0x86: {
      const std::uint32_t address = from_wire(payload);
      for (std::uint32_t i = 4; i + 4 <= size && status == kOk; i += 4)
        status =
            may_write(from, address) ? store(address + i - 4, from_wire(payload + i)) : kDenied;
      body.u16(0).u16(size - 4);
      break;
    }
    default:
      status = kNotImplemented;
  }
  if (!wants_answer && command != 0x02) return;
  Wire out;
  out.u16(status).u16(command + 1).u16(static_cast<std::uint32_t>(body.bytes().size())).u16(id);
  std::vector<std::uint8_t> all = out.bytes();
  all.insert(all.end(), body.bytes().begin(), body.bytes().end());
  (void)::sendto(fd, all.data(), all.size(), MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&from),
                 sizeof from);
}

std::uint32_t GigeCamera::write_registers(const std::uint8_t* payload, std::uint32_t size,
                                          const sockaddr_in& from) {
  for (std::uint32_t i = 0; i + 8 <= size; i += 8) {
    const std::uint32_t address = from_wire(payload + i), value = from_wire(payload + i + 4);
    if (!may_write(from, address)) return kDenied;
    if (address == kControl) {
      controller_ = value != 0 ? from : sockaddr_in{};
      heard_ = monotonic_now();
      if (value == 0) acquiring_ = false;
    }
    if (const std::uint32_t status = store(address, value); status != kOk) return status;
  }
  return kOk;
}

bool GigeCamera::value_fits(std::uint32_t address, std::uint32_t value) const {
  const auto w = static_cast<std::uint32_t>(options_.sensor_width),
             h = static_cast<std::uint32_t>(options_.sensor_height);
  switch (address) {
    case width:
      return value >= 16 && value % 8 == 0 && value + word(offset_x) <= w;
    case height:
      return value >= 16 && value % 2 == 0 && value + word(offset_y) <= h;
    case offset_x:
      return value % 8 == 0 && value + word(width) <= w;
    case offset_y:
      return value % 2 == 0 && value + word(height) <= h;
    case kPacketSize: {
      const std::uint32_t size = value & 0xFFFFU;
      return size >= kSmallestPacket && size <= kLargestPacket && size % 4 == 0;
    }
    case frame_rate: {
      const float rate = std::bit_cast<float>(value);
      return rate >= 0.5F && rate <= 400.0F;
    }
    default:
      return true;
  }
}

/// Precondition: mutex_ held.
std::uint32_t GigeCamera::store(std::uint32_t address, std::uint32_t value) {
  if (address + 4 > kDescription) return kInvalidAddress;
  if (!value_fits(address, value)) return kInvalidParameter;
  switch (address) {
    case acquisition_start:
      acquiring_ = true;
      ++starts_;
      pulses_.clear();
      follow_registers();
      changed_.notify_all();
      return kOk;
    case acquisition_stop:
      acquiring_ = false;
      pulses_.clear();
      changed_.notify_all();
      return kOk;
    case trigger_software:
      pulses_.emplace_back(triggered_++, monotonic_now());
      changed_.notify_all();
      return kOk;
    case kLatch: {
      const std::uint64_t now = ticks(monotonic_now());
      put(kLatchedHigh, static_cast<std::uint32_t>(now >> 32U));
      put(kLatchedHigh + 4, static_cast<std::uint32_t>(now));
      return kOk;
    }
    case ptp_enable:
      put(ptp_status, value != 0 ? 9 : 3);
      break;
    case kPacketSize:
      put(address, value & ~kFireTest);
      follow_registers();
      if ((value & kFireTest) != 0) sender_.fire_test_packet(value & 0xFFFFU);
      return kOk;
    default:
      break;
  }
  put(address, value);
  put(payload_size, payload());
  return kOk;
}

/// Precondition: mutex_ held.
void GigeCamera::follow_registers() {
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_port = htons(static_cast<std::uint16_t>(word(kStreamPort)));
  target.sin_addr.s_addr = htonl(word(kStreamTarget));
  const std::uint64_t f = options_.tick_frequency;
  sender_.aim(
      target, word(kPacketSize) & 0xFFFFU,
      f == 0 ? Duration{}
             : Duration::seconds(static_cast<double>(word(kPacketDelay)) / static_cast<double>(f)));
}

}  // namespace vergence::test
