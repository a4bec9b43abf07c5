#include "drivers/gnss/device.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <utility>

#include "drivers/serial/serial_port.hpp"

namespace vergence::gnss {
namespace {

// Exceeds pauses within an epoch.
constexpr Duration kQuiet = Duration::milliseconds(40);
// Time per baud rate: an epoch at 1 Hz.
constexpr Duration kListen = Duration::milliseconds(1300);
constexpr Duration kMeasure = Duration::milliseconds(3500);
// The shortest of these is the receiver's interval.
constexpr std::uint64_t kIntervals = 3;
constexpr std::array<std::uint32_t, 7> kBauds{9600, 38400, 115200, 460800, 230400, 57600, 4800};
// Relative difference above which the rate counts as another.
constexpr double kOtherRate = 0.2;

const char* name_of(Protocol protocol) noexcept {
  return protocol == Protocol::nmea ? "nmea" : "ubx";
}

}  // namespace

Device::Device(std::unique_ptr<SerialLinkFactory> place, const Options& options)
    : SerialInsDevice(std::move(place)), options_(options), decoder_(options) {
  info_.driver = name_of(options.protocol);
  info_.model =
      options.protocol == Protocol::nmea ? "NMEA 0183 receiver" : "u-blox receiver (NAV-PVT)";
}

Device::~Device() { stop(); }

DeviceStatus Device::open() {
  LineSettings settings;
  settings.baud = baud_ != 0 ? baud_ : options_.baud != 0 ? options_.baud : kBauds[0];
  return open_line(settings);
}

DeviceStatus Device::connect() {
  DeviceStatus status = open_anew();
  if (status != DeviceStatus::ok) return status;
  has_native_usb_ = is_native_usb(place().name());
  status = find();
  if (status == DeviceStatus::ok) status = measure_rate();
  if (status != DeviceStatus::ok) close_line();
  return status;
}

/// The requested baud rate only, or that of the last fix and the usual ones.
DeviceStatus Device::search() {
  if (options_.baud != 0) return listen(options_.baud);
  DeviceStatus status = baud_ != 0 ? listen(baud_) : DeviceStatus::not_found;
  for (std::size_t i = 0; i < kBauds.size() && status == DeviceStatus::not_found; ++i)
    status = listen(kBauds[i]);
  return status;
}

DeviceStatus Device::find() {
  const std::uint64_t sentences = decoder_.sentences(), frames = decoder_.frames();
  const DeviceStatus status = search();
  if (status == DeviceStatus::not_found)
    last_error_ = place().name() + ": " +
                  received_instead(decoder_.sentences() - sentences, decoder_.frames() - frames);
  return status;
}

std::string Device::received_instead(std::uint64_t sentences, std::uint64_t frames) const {
  const bool nmea = options_.protocol == Protocol::nmea;
  if (nmea && sentences > 0)
    return "it sends NMEA 0183, but neither GGA nor RMC; enable GGA and RMC on this port";
  if (nmea && frames > 0) return "it sends UBX; set ins.driver to ubx, or enable NMEA on this port";
  if (!nmea && frames > 0)
    return "it sends UBX, but no NAV-PVT; enable UBX-NAV-PVT on this port (u-center)";
  if (!nmea && sentences > 0)
    return "it sends NMEA 0183; set ins.driver to nmea, or enable UBX-NAV-PVT on this port "
           "(u-center)";
  return options_.baud != 0
             ? "nothing is received at " + std::to_string(options_.baud) +
                   " baud; set ins.baud to its rate, or to 0 to detect it"
             : "nothing is received at any usual baud rate; check power, cable and port";
}

DeviceStatus Device::listen(std::uint32_t baud) {
  if (line()->baud() != baud) {
    const DeviceStatus status = line()->set_baud(baud);
    if (status == DeviceStatus::unsupported) return DeviceStatus::not_found;
    if (status != DeviceStatus::ok) return status;
  }
  decoder_.begin(has_native_usb_ ? 0 : baud);
  const std::uint64_t fixes = decoder_.fixes();
  for (const HostStamp until = line()->now() + kListen; line()->now() < until;) {
    if (stop_requested()) return DeviceStatus::stopped;
    const DeviceStatus status = read_once(kQuiet, true);
    if (status != DeviceStatus::ok && status != DeviceStatus::timeout) return status;
    if (decoder_.fixes() == fixes) continue;
    baud_ = baud;
    return DeviceStatus::ok;
  }
  return DeviceStatus::not_found;
}

/// A receiver without a fix may send no time; its rate is then determined later.
DeviceStatus Device::measure_rate() {
  const std::uint64_t before = decoder_.counters().readings;
  for (const HostStamp until = line()->now() + kMeasure; line()->now() < until;) {
    const DeviceStatus status = read_once(kQuiet, true);
    if (status != DeviceStatus::ok && status != DeviceStatus::timeout) {
      last_error_ = place().name() + ": " + std::string(to_string(status));
      return status;
    }
    if (decoder_.counters().readings - before > kIntervals) break;
  }
  rate_hz_ = decoder_.period() == Duration{} ? 0 : 1 / decoder_.period().to_seconds();
  return DeviceStatus::ok;
}

DeviceStatus Device::configure(double rate_hz, double* actual_hz) noexcept {
  try {
    last_error_.clear();
    remark_.clear();
    stop();
    if (!(rate_hz > 0)) return DeviceStatus::bad_configuration;
    if (line() == nullptr) {
      if (const DeviceStatus s = connect(); s != DeviceStatus::ok) return s;
    }
    std::array<char, 160> text{};
    if (rate_hz_ > 0 && std::abs(rate_hz_ - rate_hz) > kOtherRate * rate_hz_) {
      (void)std::snprintf(text.data(), text.size(),
                          "the receiver sends at %.3g Hz, but ins.rate is %.4g; set ins.rate to "
                          "%.3g, or change the rate of the receiver with its own tool",
                          rate_hz_, rate_hz, rate_hz_);
      last_error_ = text.data();
      return DeviceStatus::unsupported;
    }
    const HeadingSource heading = decoder_.best_heading();
    remark_ = "it sends no attitude, so position is compared, and ";
    remark_ += heading == HeadingSource::heading ? "measured heading"
                                                 : "course, as heading, once the vehicle moves";
    if (rate_hz_ <= 0) remark_ += "; it has no fix yet";
    configured_ = true;
    if (actual_hz != nullptr) *actual_hz = rate_hz_ > 0 ? rate_hz_ : rate_hz;
    return DeviceStatus::ok;
    // Out of memory.
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceTiming Device::timing() const noexcept {
  DeviceTiming t;
  t.min_delay = options_.processing;
  t.delay_spread = place().latency_timer() + Duration::milliseconds(60);
  t.resolution = Duration::milliseconds(1);
  return t;
}

// ---- the device's thread

DeviceStatus Device::begin() noexcept {
  // The transmission time of buffered bytes is unknown.
  line()->discard_input();
  decoder_.begin(has_native_usb_ ? 0 : line()->baud());
  return DeviceStatus::ok;
}

DeviceStatus Device::read_on() noexcept {
  HostStamp last_received = line()->now();
  std::uint64_t fixes = decoder_.fixes();
  for (;;) {
    if (stop_requested()) return DeviceStatus::stopped;
    const DeviceStatus status = read_once(kQuiet, false);
    if (status != DeviceStatus::ok && status != DeviceStatus::timeout &&
        status != DeviceStatus::stopped)
      return status;
    if (decoder_.fixes() != fixes) last_received = line()->now();
    fixes = decoder_.fixes();
    if (line()->now() - last_received > kSilent) return DeviceStatus::disconnected;
  }
}

DeviceStatus Device::read_once(Duration limit, bool discard) noexcept {
  std::array<std::uint8_t, Decoder::kMaxBytes> bytes{};
  const LineRead r = line()->read(bytes, limit);
  if (r.status == DeviceStatus::ok)
    decoder_.accept(std::span(bytes).first(r.size), r.arrival);
  else if (r.status == DeviceStatus::timeout)
    decoder_.quiet();
  else
    return r.status;
  for (InsReading reading; decoder_.next(&reading);)
    if (!discard) hand_out(reading, reading.arrival);
  count_decoded();
  return r.status;
}

/// A receiver that lost its supply may return to its default rate.
DeviceStatus Device::reopen() {
  if (const DeviceStatus s = open(); s != DeviceStatus::ok) return s;
  return search();
}

void Device::count_decoded() noexcept {
  const DecoderCounters c = decoder_.counters();
  count(c.lost, c.malformed, c.restarts);
}

}  // namespace vergence::gnss
