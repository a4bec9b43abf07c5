#include "tests/support/gige_camera.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>

#include "drivers/clock.hpp"
#include "tests/support/gvsp_sender.hpp"

namespace vergence::test {
namespace {

using namespace gige_register;

constexpr std::uint16_t kControlPort = 3956;
constexpr std::size_t kLatchedPulses = 256;  // exposed one after the other, stamped with their own
                                             // time: a busy machine's delays are none
constexpr std::uint32_t kMemory = 0x40000,
                        kDescription = 0x20000;  // bytes; address of the description in it
constexpr std::uint32_t kHeartbeat = 0x938, kTicksHigh = 0x93C, kTicksLow = 0x940, kLatch = 0x944,
                        kLatchedHigh = 0x948, kControl = 0xA00, kStreamPort = 0xD00,
                        kPacketSize = 0xD04, kPacketDelay = 0xD08, kStreamTarget = 0xD18;
constexpr std::uint32_t kFireTest = 1U << 31U;
// Chunks: their numbers, and their places in ChunkSelector.
constexpr std::uint32_t kImageChunk = 0xA5A50001, kExposureChunk = 0xA5A50002,
                        kTimestampChunk = 0xA5A50003;
constexpr std::uint32_t kSelectExposure = 1, kSelectTimestamp = 2;
// Status codes of GVCP.
constexpr std::uint32_t kOk = 0, kNotImplemented = 0x8001, kInvalidParameter = 0x8002,
                        kInvalidAddress = 0x8003, kDenied = 0x8006;

std::uint32_t from_wire(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(p[0]) << 24U | static_cast<std::uint32_t>(p[1]) << 16U |
         static_cast<std::uint32_t>(p[2]) << 8U | p[3];
}
std::uint32_t from_wire16(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(p[0]) << 8U | p[1];
}

int datagram_socket(const char* address) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(kControlPort);
  const int on = 1;
  if (fd >= 0 && ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
      ::inet_pton(AF_INET, address, &own.sin_addr) == 1 &&
      ::bind(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0)
    return fd;
  if (fd >= 0) (void)::close(fd);
  return -1;
}

}  // namespace

class GigeCamera::Impl {
 public:
  explicit Impl(const GigeCameraOptions& options);
  ~Impl();

  const GigeCameraOptions options;
  GvspSender sender;

  std::uint32_t get(std::uint32_t address) const {
    const std::lock_guard lock(mutex_);
    return word(address);
  }
  void set(std::uint32_t address, std::uint32_t value) {
    const std::lock_guard lock(mutex_);
    (void)store(address, value);
  }
  void power(bool on);
  void pulse(std::uint64_t number, std::uint32_t source, HostStamp when);
  void take_control(bool taken) {
    const std::lock_guard lock(mutex_);
    controller_ = {};
    foreign_ = taken;
    put(kControl, taken ? 2 : 0);
    acquiring_ = false;  // as whenever its controller changes
  }
  std::uint64_t ticks(HostStamp host) const {
    if (options.tick_frequency == 0) return 0;
    const double f = static_cast<double>(options.tick_frequency) * 1e-9;
    const double ns =
        static_cast<double>(host.ns() - born_.ns()) * (1 + options.clock_drift_ppm * 1e-6);
    return static_cast<std::uint64_t>(
        std::llround((static_cast<double>(options.clock_offset_ns) + ns) * f));
  }
  bool acquiring() const {
    const std::lock_guard lock(mutex_);
    return acquiring_;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool silent_ = false;
  int lose_ = 0, tear_ = 0, delay_ = 0, garble_ = 0;
  std::map<std::uint64_t, double> exposed_;  // µs, by image
  int lie_width_ = 0, lie_height_ = 0;
  std::uint64_t ignored_ = 0, starts_ = 0;

 private:
  void answer();
  void handle(int fd, const std::uint8_t* bytes, std::size_t length, const sockaddr_in& from);
  std::uint32_t write_registers(const std::uint8_t* payload, std::uint32_t length,
                                const sockaddr_in& from);
  std::uint32_t store(std::uint32_t address, std::uint32_t value);
  bool value_fits(std::uint32_t address, std::uint32_t value) const;
  void expose();
  GvspFrame make_frame(std::uint64_t number, HostStamp when);
  void append_chunks(GvspFrame* frame);
  [[nodiscard]] double exposure_of(std::uint64_t number) const;
  [[nodiscard]] bool has_chunk(std::uint32_t selected) const {
    return (chunks_enabled_ >> selected & 1U) != 0;
  }
  void follow_registers();
  [[nodiscard]] bool may_write(const sockaddr_in& from, std::uint32_t address) const;
  [[nodiscard]] std::uint32_t word(std::uint32_t address) const {
    return address + 4 <= kMemory ? from_wire(&memory_[address]) : 0;
  }
  [[nodiscard]] float real(std::uint32_t address) const {
    return std::bit_cast<float>(word(address));
  }
  [[nodiscard]] std::uint32_t payload() const {
    const std::uint32_t pixels =
        word(width) * word(height) * (word(pixel_format) >> 16U & 0xFFU) / 8;
    if (word(chunk_mode) == 0) return pixels;
    return pixels + 8 + (has_chunk(kSelectExposure) ? exposure_bytes() + 8 : 0) +
           (has_chunk(kSelectTimestamp) ? 16 : 0);
  }
  [[nodiscard]] std::uint32_t exposure_bytes() const {
    return options.old_names ? 4 : 8;
  }  // a float or a double
  void put(std::uint32_t address, std::uint32_t value) {
    for (std::uint32_t i = 0; i < 4; ++i)
      memory_[address + i] = static_cast<std::uint8_t>(value >> (24U - 8U * i));
  }
  void put_text(std::uint32_t address, const std::string& text, std::size_t room) {
    std::memcpy(&memory_[address], text.data(), std::min(text.size(), room - 1));
  }
  void reset();

  std::vector<std::uint8_t> memory_;
  HostStamp born_{};
  int control_ = -1, broadcast_ = -1, wake_ = -1;
  bool quit_ = false, powered_ = true, acquiring_ = false, foreign_ = false;
  sockaddr_in controller_{};
  HostStamp heard_{};  // the controller's last word
  std::deque<std::pair<std::uint64_t, HostStamp>>
      pulses_;                   // triggers not yet served: the image's number, and when
  std::uint64_t triggered_ = 0;  // by software
  std::uint64_t block_ = 0;
  std::uint32_t chunks_enabled_ = 1;  // bits by ChunkSelector; the image always is
  std::thread answering_, exposing_;
};

GigeCamera::Impl::Impl(const GigeCameraOptions& o)
    : options(o),
      sender(o.address, o.extended_ids, o.loss, o.seed),
      memory_(kMemory, 0),
      born_(monotonic_now()) {
  control_ = datagram_socket(o.address.c_str());
  if (control_ < 0)
    throw std::runtime_error("simulated camera: " + o.address + " port 3956 is in use");
  broadcast_ = o.discoverable ? datagram_socket("255.255.255.255") : -1;
  wake_ = ::eventfd(0, EFD_CLOEXEC);
  reset();
  answering_ = std::thread([this] { answer(); });
  exposing_ = std::thread([this] { expose(); });
  (void)pthread_setname_np(answering_.native_handle(), "simulator-c");
  (void)pthread_setname_np(exposing_.native_handle(), "simulator-x");
}

GigeCamera::Impl::~Impl() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof one);
  answering_.join();
  exposing_.join();
  for (const int fd : {control_, broadcast_, wake_})
    if (fd >= 0) (void)::close(fd);
}

/// As after power on. Precondition: mutex_ held, or no thread yet.
void GigeCamera::Impl::reset() {
  std::fill(memory_.begin(), memory_.end(), std::uint8_t{0});
  in_addr own{};
  (void)::inet_pton(AF_INET, options.address.c_str(), &own);
  put(0x00, 0x00010002);
  put(0x04, 0x80000001);  // big endian, UTF-8
  put(0x08, 0x0000'0200);
  put(0x0C, ntohl(own.s_addr));  // a hardware address of its own
  put(0x10, 0x7);
  put(0x14, 0x5);
  put(0x24, ntohl(own.s_addr));
  put(0x34, 0xFF000000);
  put_text(0x48, "Vergence", 32);
  put_text(0x68, "Simulator", 32);
  put_text(0x88, "1", 32);
  put_text(0xA8, "a GigE camera for tests", 48);
  put_text(0xD8, options.serial, 16);
  const std::string description = gige_description(options);
  put_text(
      0x200,
      "Local:simulator.xml;" +
          [&] {
            char hex[32];
            (void)std::snprintf(hex, sizeof hex, "%X;%zX", kDescription, description.size());
            return std::string(hex);
          }(),
      512);
  if (kDescription + description.size() > kMemory)
    throw std::runtime_error("simulated camera: the description is too long");
  std::memcpy(&memory_[kDescription], description.data(), description.size());
  put(0x600, 1);
  put(0x900, 0);
  put(0x904, 1);
  put(0x934, (options.resend ? 4U : 0U) | 2U | 1U);
  put(kHeartbeat, options.heartbeat_ms);
  put(kTicksHigh, static_cast<std::uint32_t>(options.tick_frequency >> 32U));
  put(kTicksLow, static_cast<std::uint32_t>(options.tick_frequency));
  put(kPacketSize, 1500);
  put(sensor_width, static_cast<std::uint32_t>(options.sensor_width));
  put(sensor_height, static_cast<std::uint32_t>(options.sensor_height));
  put(width, static_cast<std::uint32_t>(options.sensor_width));
  put(height, static_cast<std::uint32_t>(options.sensor_height));
  put(pixel_format, 0x01080001);
  put(payload_size, payload());
  put(acquisition_mode, 2);
  put(frame_rate, std::bit_cast<std::uint32_t>(10.0F));
  put(exposure_time, std::bit_cast<std::uint32_t>(5000.0F));
  put(trigger_selector, 1);
  put(exposure_mode, 1);
  put(exposure_auto, 2);  // as many cameras come: on
  put(gain_auto, 2);
  put(line_selector, 1);
  chunks_enabled_ = 1;
  put(chunk_enable, 1);
  put(ptp_status, 3);
  acquiring_ = false;
  controller_ = {};
  block_ = options.first_block;
  pulses_.clear();
}

void GigeCamera::Impl::power(bool on) {
  {
    const std::lock_guard lock(mutex_);
    if (on && !powered_) reset();
    powered_ = on;
    if (!on) acquiring_ = false;
  }
  changed_.notify_all();
}

// ---- control

void GigeCamera::Impl::answer() {
  std::array<std::uint8_t, 2048> bytes{};
  for (;;) {
    std::array<pollfd, 3> fds{{{wake_, POLLIN, 0}, {control_, POLLIN, 0}, {broadcast_, POLLIN, 0}}};
    (void)::poll(fds.data(), fds.size(), 50);
    std::unique_lock lock(mutex_);
    if (quit_) return;
    const bool silent_for_long =
        !foreign_ && word(kControl) != 0 &&
        monotonic_now() - heard_ > Duration::milliseconds(word(kHeartbeat));
    if (silent_for_long) {  // its controller is gone
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

bool GigeCamera::Impl::may_write(const sockaddr_in& from, std::uint32_t address) const {
  if (foreign_) return false;
  const bool in_control = word(kControl) != 0;
  const bool theirs =
      controller_.sin_port == from.sin_port && controller_.sin_addr.s_addr == from.sin_addr.s_addr;
  return in_control ? theirs : address == kControl;
}

void GigeCamera::Impl::handle(int fd, const std::uint8_t* bytes, std::size_t length,
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
    case 0x02:  // discovery
      for (std::uint32_t i = 0; i < 0xF8; ++i) body.u8(memory_[i]);
      break;
    case 0x40:  // resend; never answered
      if (size >= 12) {
        std::uint64_t block = from_wire(payload) & 0xFFFFU;
        if (extended && size >= 20)
          block =
              static_cast<std::uint64_t>(from_wire(payload + 12)) << 32U | from_wire(payload + 16);
        if (options.resend)
          sender.resend(block, from_wire(payload + 4) & (extended ? ~0U : 0xFFFFFFU),
                        from_wire(payload + 8) & (extended ? ~0U : 0xFFFFFFU));
      }
      return;
    case 0x80:  // read registers
      for (std::uint32_t i = 0; i + 4 <= size; i += 4) {
        const std::uint32_t address = from_wire(payload + i);
        if (address + 4 > kMemory) status = kInvalidAddress;
        body.u32(word(address));
      }
      break;
    case 0x82:  // write registers
      status = write_registers(payload, size, from);
      body.u16(0).u16(status == kOk ? size / 8 : 0);
      break;
    case 0x84: {  // read memory
      const std::uint32_t address = from_wire(payload), count = from_wire16(payload + 6);
      if (size < 8 || address > kMemory || count > 536 || address + count > kMemory) {
        status = kInvalidAddress;
        break;
      }
      body.u32(address);
      for (std::uint32_t i = 0; i < count; ++i) body.u8(memory_[address + i]);
      break;
    }
    case 0x86: {  // write memory: registers in a row
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

std::uint32_t GigeCamera::Impl::write_registers(const std::uint8_t* payload, std::uint32_t size,
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

bool GigeCamera::Impl::value_fits(std::uint32_t address, std::uint32_t value) const {
  const auto w = static_cast<std::uint32_t>(options.sensor_width),
             h = static_cast<std::uint32_t>(options.sensor_height);
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
      return size >= options.smallest_packet && size <= options.largest_packet && size % 4 == 0;
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
std::uint32_t GigeCamera::Impl::store(std::uint32_t address, std::uint32_t value) {
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
    case chunk_selector:
      put(chunk_enable, has_chunk(value & 31U) ? 1 : 0);
      break;
    case chunk_enable: {
      const std::uint32_t bit = 1U << (word(chunk_selector) & 31U);
      chunks_enabled_ = (value != 0 ? chunks_enabled_ | bit : chunks_enabled_ & ~bit) | 1U;
      break;
    }
    case kPacketSize:
      put(address, value & ~kFireTest);
      follow_registers();
      if ((value & kFireTest) != 0) sender.fire_test_packet(value & 0xFFFFU);
      return kOk;
    default:
      break;
  }
  put(address, value);
  put(payload_size, payload());
  return kOk;
}

/// Precondition: mutex_ held.
void GigeCamera::Impl::follow_registers() {
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_port = htons(static_cast<std::uint16_t>(word(kStreamPort)));
  target.sin_addr.s_addr = htonl(word(kStreamTarget));
  const std::uint64_t f = options.tick_frequency;
  sender.aim(
      target, word(kPacketSize) & 0xFFFFU,
      f == 0 ? Duration{}
             : Duration::seconds(static_cast<double>(word(kPacketDelay)) / static_cast<double>(f)));
}

// ---- exposures

void GigeCamera::Impl::pulse(std::uint64_t number, std::uint32_t source, HostStamp when) {
  const std::lock_guard lock(mutex_);
  if (!acquiring_ || !powered_ || word(trigger_mode) == 0 || word(trigger_source) != source ||
      pulses_.size() >= kLatchedPulses) {
    ++ignored_;
    return;
  }
  pulses_.emplace_back(number, when.ns() != 0 ? when : monotonic_now());
  changed_.notify_all();
}

GvspFrame GigeCamera::Impl::make_frame(std::uint64_t number, HostStamp when) {
  GvspFrame f;
  f.number = number;
  f.block = block_++;
  if (!options.extended_ids && block_ > 0xFFFFU) block_ = 1;
  f.ticks = ticks(when);
  f.pixel_format = word(pixel_format);
  f.width = static_cast<int>(word(width));
  f.height = static_cast<int>(word(height));
  f.offset_x = static_cast<int>(word(offset_x));
  f.offset_y = static_cast<int>(word(offset_y));
  if (lie_width_ > 0) {
    f.width = lie_width_;
    f.height = lie_height_;
  }
  const std::size_t bytes = static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height) *
                            (f.pixel_format >> 16U & 0xFFU) / 8;
  const std::uint8_t* given = options.images ? options.images(number) : nullptr;
  if (given != nullptr) {
    f.pixels.assign(given, given + bytes);
  } else {
    f.pixels.assign(bytes, static_cast<std::uint8_t>(31 * number));  // every byte tells its image
  }
  if (options.number_images)
    for (std::size_t i = 0; i < 8; ++i) f.pixels[i] = static_cast<std::uint8_t>(number >> (8 * i));
  if (word(chunk_mode) != 0) append_chunks(&f);
  return f;
}

/// Precondition: mutex_ held, the exposure is known.
void GigeCamera::Impl::append_chunks(GvspFrame* f) {
  f->payload_type = options.chunk_payload;
  const std::size_t pixels = f->pixels.size();
  Wire w;
  w.u32(kImageChunk).u32(static_cast<std::uint32_t>(pixels));
  if (has_chunk(kSelectTimestamp)) w.u64(f->ticks).u32(kTimestampChunk).u32(8);
  if (has_chunk(kSelectExposure)) {
    const double us = exposed_[f->number];
    if (options.old_names) {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(us));  // little endian
      for (std::uint32_t i = 0; i < 4; ++i) w.u8(bits >> (8 * i) & 0xFFU);
    } else {
      w.u64(std::bit_cast<std::uint64_t>(us));
    }
    w.u32(kExposureChunk).u32(exposure_bytes());
  }
  f->pixels.insert(f->pixels.end(), w.bytes().begin(), w.bytes().end());
  if (garble_ > 0) {
    --garble_;
    std::uint32_t noise = static_cast<std::uint32_t>(f->number) * 2654435761U;
    for (std::size_t i = pixels; i < f->pixels.size(); ++i) {
      noise = noise * 1664525U + 1013904223U;
      f->pixels[i] = static_cast<std::uint8_t>(noise >> 24U);
    }
  }
}

/// µs, as the wire has it. Precondition: mutex_ held.
double GigeCamera::Impl::exposure_of(std::uint64_t number) const {
  const auto set = static_cast<double>(real(exposure_time));
  const double us = options.exposures ? options.exposures(number, set) : set;
  return options.old_names ? static_cast<double>(static_cast<float>(us)) : us;
}

void GigeCamera::Impl::expose() {
  std::unique_lock lock(mutex_);
  HostStamp last{};
  for (;;) {
    lock.unlock();
    sender.send_held(monotonic_now());
    lock.lock();
    if (quit_) return;
    const bool triggered = word(trigger_mode) != 0;
    if (!acquiring_ || !powered_ || silent_ || (triggered && pulses_.empty())) {
      (void)changed_.wait_for(lock, std::chrono::milliseconds(20));
      continue;
    }
    std::uint64_t number = 0;
    HostStamp when = monotonic_now();
    const Duration exposure = Duration::seconds(static_cast<double>(real(exposure_time)) * 1e-6);
    if (triggered) {
      std::tie(number, when) = pulses_.front();
    } else {
      const std::int64_t period =
          Duration::seconds(1.0 / static_cast<double>(real(frame_rate))).ns();
      number =
          static_cast<std::uint64_t>(std::max(when.ns() - exposure.ns(), last.ns()) / period + 1);
      when = HostStamp(static_cast<std::int64_t>(number) * period);
      last = when;
    }
    const double us = exposure_of(number);
    exposed_[number] = us;
    lock.unlock();
    sleep_until(when + Duration::seconds(us * 1e-6));
    lock.lock();
    if (triggered && !pulses_.empty()) pulses_.pop_front();
    if (!acquiring_ || !powered_ || silent_) continue;
    GvspFrame frame = make_frame(number, when);
    GvspSender::Fate fate = GvspSender::Fate::normal;
    if (lose_ > 0) {
      --lose_;
      fate = GvspSender::Fate::unsent;
    } else if (tear_ > 0) {
      --tear_;
      fate = GvspSender::Fate::torn;
    } else if (delay_ > 0) {
      --delay_;
      fate = GvspSender::Fate::delayed;
    }
    lock.unlock();
    sender.send(std::move(frame), fate);
    lock.lock();
  }
}

// ---- the front

GigeCamera::GigeCamera(const GigeCameraOptions& options) : impl_(std::make_unique<Impl>(options)) {}
GigeCamera::~GigeCamera() = default;

std::string GigeCamera::address(int k) {
  const auto pid = static_cast<unsigned>(::getpid());
  return "127." + std::to_string(1 + (pid >> 8U) % 250) + "." + std::to_string(pid & 0xFFU) + "." +
         std::to_string(k + 2);
}

void GigeCamera::unplug() { impl_->power(false); }
void GigeCamera::replug() { impl_->power(true); }
void GigeCamera::silence(bool silent) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->silent_ = silent;
}
void GigeCamera::lose_frames(int exposures) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->lose_ += exposures;
}
void GigeCamera::tear_frames(int exposures) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->tear_ += exposures;
}
void GigeCamera::delay_frames(int exposures, Duration by) {
  impl_->sender.hold_back(by);
  const std::lock_guard lock(impl_->mutex_);
  impl_->delay_ += exposures;
}
void GigeCamera::set_loss(double share) { impl_->sender.set_loss(share); }
void GigeCamera::garble_chunks(int exposures) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->garble_ += exposures;
}
double GigeCamera::exposed(std::uint64_t number) const {
  const std::lock_guard lock(impl_->mutex_);
  const auto at = impl_->exposed_.find(number);
  return at == impl_->exposed_.end() ? 0 : at->second;
}
void GigeCamera::lie_about_size(int width, int height) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->lie_width_ = width;
  impl_->lie_height_ = height;
}
void GigeCamera::pulse(std::uint64_t number, HostStamp when) { impl_->pulse(number, 1, when); }
void GigeCamera::take_control(bool taken) { impl_->take_control(taken); }
GigeCameraReport GigeCamera::report() const {
  GigeCameraReport r;
  impl_->sender.add_to(&r);
  const std::lock_guard lock(impl_->mutex_);
  r.ignored_triggers = impl_->ignored_;
  r.starts = impl_->starts_;
  return r;
}
std::vector<std::uint64_t> GigeCamera::whole() const { return impl_->sender.whole(); }
std::uint32_t GigeCamera::read(std::uint32_t address) const { return impl_->get(address); }
void GigeCamera::write(std::uint32_t address, std::uint32_t value) { impl_->set(address, value); }
HostStamp GigeCamera::sent(std::uint64_t number) const { return impl_->sender.sent(number); }
std::uint64_t GigeCamera::ticks(HostStamp host) const { return impl_->ticks(host); }
bool GigeCamera::acquiring() const { return impl_->acquiring(); }
const GigeCameraOptions& GigeCamera::options() const { return impl_->options; }

}  // namespace vergence::test
