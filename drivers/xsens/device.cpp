#include "drivers/xsens/device.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <utility>

#include "drivers/format_text.hpp"

namespace vergence::xsens {
namespace {

constexpr Duration kRead = Duration::milliseconds(200);

}  // namespace

Device::Device(std::unique_ptr<SerialLinkFactory> place, const Options& options)
    : SerialInsDevice(std::move(place)), options_(options) {
  info_.driver = "xsens";
}

Device::~Device() { stop(); }

// ---- the owner's thread

DeviceStatus Device::open() {
  LineSettings settings;
  if (baud_ != 0) settings.baud = baud_;
  // MTi-G units built before 2008 use two stop bits; a receiver with one treats the second as idle
  // line.
  settings.stop_bits = 2;
  return open_line(settings);
}

DeviceStatus Device::connect() {
  DeviceStatus status = open_anew();
  if (status != DeviceStatus::ok) return status;
  Setup setup(*line(), options_, stopping());
  status = setup.find();
  if (status == DeviceStatus::ok) status = setup.identify(&identity_);
  if (status != DeviceStatus::ok) {
    last_error_ = place().name() + ": " + setup.last_error();
    close_line();
    return status;
  }
  baud_ = line()->baud();
  info_.serial = format_text("%08X", identity_.device_id);
  info_.model = static_cast<const char*>(identity_.product);
  return DeviceStatus::ok;
}

DeviceStatus Device::configure(double rate_hz, double* actual_hz) noexcept {
  try {
    last_error_.clear();
    remark_.clear();
    if (!(rate_hz > 0 && rate_hz <= 2000)) {
      last_error_ = "a rate of " + std::to_string(rate_hz) +
                    " Hz is not possible; set ins.rate to 100 or 120";
      return DeviceStatus::bad_configuration;
    }
    stop();
    if (line() == nullptr) {
      if (const DeviceStatus s = connect(); s != DeviceStatus::ok) return s;
    }
    Setup setup(*line(), options_, stopping());
    // Returns to the configuration state if it was measuring.
    DeviceStatus status = setup.find();
    StreamSettings set;
    if (status == DeviceStatus::ok) status = setup.set(identity_, rate_hz, &set);
    if (status != DeviceStatus::ok) {
      last_error_ = setup.last_error();
      return status;
    }
    set_ = set;
    baud_ = line()->baud();
    rate_hz_ = rate_hz;
    configured_ = true;
    remark_ = remark_about(rate_hz);
    if (actual_hz != nullptr) *actual_hz = set_.rate_hz();
    return DeviceStatus::ok;
    // Out of memory.
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

std::string Device::remark_about(double rate_hz) const {
  const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-6 * b; };
  std::string all;
  if (differs(set_.rate_hz(), rate_hz))
    all = format_text("it measures at %.4g Hz, the nearest rate to %.4g", set_.rate_hz(), rate_hz);
  if (set_.sync_out_hz > 0 && differs(set_.sync_out_hz, options_.sync_out_hz))
    all += (all.empty() ? "" : "; ") +
           format_text("its SyncOut pulses at %.4g Hz, the nearest rate to %.4g", set_.sync_out_hz,
                       options_.sync_out_hz);
  return all;
}

DeviceTiming Device::timing() const noexcept {
  DeviceTiming t;
  const std::size_t bytes = set_.generation == xbus::Generation::legacy
                                ? xbus::frame_size(set_.layout.payload_size().value_or(0))
                                : 100;
  t.min_delay = options_.processing +
                Duration::nanoseconds(xbus::wire_time_ns(bytes, baud_ == 0 ? 115200 : baud_));
  // A burst of 496 bytes at 115200 baud.
  t.delay_spread = place().latency_timer() + Duration::milliseconds(60);
  t.resolution = Duration::microseconds(100);
  return t;
}

// ---- the device's thread

DeviceStatus Device::begin() noexcept {
  try {
    Setup setup(*line(), options_, stopping());
    DeviceStatus status = setup.find();
    if (status == DeviceStatus::ok) status = setup.measure();
    if (status != DeviceStatus::ok) return status;
    decoder_.begin(set_, line()->baud(), options_.processing);
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus Device::read_on() noexcept {
  last_sample_ = line()->now();
  // Earlier requests are obsolete.
  gap_ns_.store(0, std::memory_order_relaxed);
  for (;;) {
    if (stop_requested()) return DeviceStatus::stopped;
    DeviceStatus status = read_once(kRead);
    if (const std::int64_t gap = gap_ns_.exchange(0, std::memory_order_relaxed);
        gap > 0 && status != DeviceStatus::disconnected)
      status = make_gap(Duration::nanoseconds(gap));
    if (status != DeviceStatus::ok && status != DeviceStatus::timeout) return status;
    // Reopening configures it again, because a restart may have lost its settings.
    if (decoder_.woke()) return DeviceStatus::disconnected;
    if (line()->now() - last_sample_ > silent_after()) return DeviceStatus::disconnected;
  }
}

Duration Device::silent_after() const noexcept {
  // At 1 Hz a single lost message is not a silence.
  constexpr double kIntervals = 4;
  return std::max(kSilent, Duration::seconds(kIntervals / set_.rate_hz()));
}

/// Hands out the samples of a read. → ok, timeout (also if woken), ended, disconnected, failed
DeviceStatus Device::read_once(Duration limit) noexcept {
  std::array<std::uint8_t, Decoder::kMaxBytes> bytes{};
  const LineRead r = line()->read(bytes, limit);
  if (r.status == DeviceStatus::timeout) decoder_.quiet();
  if (r.status == DeviceStatus::stopped) return DeviceStatus::timeout;
  if (r.status != DeviceStatus::ok) return r.status;
  decoder_.accept(std::span(bytes).first(r.size), r.arrival);
  for (InsReading reading; decoder_.next(&reading);) hand_out(reading, reading.arrival);
  count_decoded();
  last_sample_ = std::max(last_sample_, decoder_.last_sample());
  return r.status;
}

DeviceStatus Device::pause(Duration gap) noexcept {
  if (identity_.generation != xbus::Generation::mark4) return DeviceStatus::unsupported;
  if (!streaming()) return DeviceStatus::stopped;
  gap_ns_.store(gap.ns(), std::memory_order_relaxed);
  return DeviceStatus::ok;
}

/// SyncOut pulses accompany every n-th sample, so all samples up to the device's response and from
/// its next one on are handed out.
DeviceStatus Device::make_gap(Duration gap) noexcept {
  if (const DeviceStatus s = announce(xbus::MessageId::go_to_config); s != DeviceStatus::ok)
    return s;
  const HostStamp end = line()->now() + gap;
  while (line()->now() < end) {
    if (stop_requested()) return DeviceStatus::stopped;
    const DeviceStatus s = read_once(std::min(kRead, end - line()->now()));
    if (s != DeviceStatus::ok && s != DeviceStatus::timeout) return s;
  }
  // It was silent by request.
  last_sample_ = line()->now();
  return announce(xbus::MessageId::go_to_measurement);
}

/// → ok (it responded), stopped, disconnected, failed
DeviceStatus Device::announce(xbus::MessageId request) noexcept {
  constexpr int kTimes = 4;
  constexpr Duration kAnswer = Duration::milliseconds(150), kWrite = Duration::milliseconds(100);
  std::array<std::uint8_t, xbus::kMaxFrame> frame{};
  const xbus::WrittenFrame w =
      xbus::write_frame({xbus::kBusMaster, static_cast<std::uint8_t>(request), {}}, frame);
  (void)decoder_.answered(request);
  for (int i = 0; i < kTimes; ++i) {
    const DeviceStatus sent = line()->write(std::span(frame).first(w.size), kWrite);
    if (sent != DeviceStatus::ok && sent != DeviceStatus::timeout) return sent;
    for (const HostStamp until = line()->now() + kAnswer; line()->now() < until;) {
      if (stop_requested()) return DeviceStatus::stopped;
      const DeviceStatus s = read_once(until - line()->now());
      if (s != DeviceStatus::ok && s != DeviceStatus::timeout) return s;
      if (decoder_.answered(request)) return DeviceStatus::ok;
    }
  }
  // Reopening configures it again.
  return DeviceStatus::disconnected;
}

/// Resumes SyncOut; cameras that it triggers would not expose after a stop.
void Device::finished() noexcept {
  if (line() == nullptr || options_.sync_out_hz <= 0) return;
  constexpr Duration kShort = Duration::milliseconds(300);
  const std::atomic<bool> never{false};
  Reply reply;
  RequestReply(*line(), never).ask(xbus::MessageId::go_to_config, {}, &reply, kShort);
}

/// Opens and sets the device again.
DeviceStatus Device::reopen() {
  if (const DeviceStatus s = open(); s != DeviceStatus::ok) return s;
  Setup setup(*line(), options_, stopping());
  Identity who;
  StreamSettings set;
  DeviceStatus status = setup.find();
  if (status == DeviceStatus::ok) status = setup.identify(&who);
  if (status == DeviceStatus::ok) status = setup.set(who, rate_hz_, &set);
  // Another device would be mounted differently, which the user has to check.
  if (status == DeviceStatus::ok && who.device_id != identity_.device_id)
    status = DeviceStatus::not_found;
  if (status != DeviceStatus::ok) return status;
  set_ = set;
  baud_ = line()->baud();
  return DeviceStatus::ok;
}

void Device::count_decoded() noexcept {
  const DecoderCounters& c = decoder_.counters();
  count(c.lost, c.malformed + decoder_.line_counters().checksum_wrong, c.restarts);
}

}  // namespace vergence::xsens
