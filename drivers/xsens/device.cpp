#include "drivers/xsens/device.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <utility>

namespace vergence::xsens {
namespace {

constexpr Duration kRead = Duration::milliseconds(200);

}  // namespace

Device::Device(std::unique_ptr<LinePlace> place, const Options& options)
    : SerialInsDevice(std::move(place)), options_(options) {
  info_.driver = "xsens";
}

Device::~Device() { stop(); }

// ---- the owner's thread

DeviceStatus Device::open() {
  LineSettings settings;
  if (baud_ != 0) settings.baud = baud_;
  // MTi-G built before 2008 want two stop bits; a receiver that wants one takes the second for idle
  // line.
  settings.stop_bits = 2;
  return open_line(settings);
}

DeviceStatus Device::connect() {
  stop();
  close_line();
  look_up_virtual_time();
  DeviceStatus status = open();
  if (status != DeviceStatus::ok) {
    last_error_ = place().name() + " cannot be opened: " + std::string(to_string(status));
    return status;
  }
  Setup setup(*line(), options_, stopping());
  status = setup.find();
  if (status == DeviceStatus::ok) status = setup.identify(&identity_);
  if (status != DeviceStatus::ok) {
    last_error_ = place().name() + ": " + setup.last_error();
    close_line();
    return status;
  }
  baud_ = line()->baud();
  std::array<char, 16> id{};
  (void)std::snprintf(id.data(), id.size(), "%08X", identity_.device_id);
  info_.serial = id.data();
  info_.model = static_cast<const char*>(identity_.product);
  return DeviceStatus::ok;
}

DeviceStatus Device::configure(double rate_hz, double* actual_hz) noexcept {
  try {
    last_error_.clear();
    remark_.clear();
    if (!(rate_hz > 0 && rate_hz <= 2000)) {
      last_error_ =
          "a rate of " + std::to_string(rate_hz) + " Hz is none; set ins.rate to 100 or 120";
      return DeviceStatus::bad_configuration;
    }
    stop();
    if (line() == nullptr) {
      if (const DeviceStatus s = connect(); s != DeviceStatus::ok) return s;
    }
    Setup setup(*line(), options_, stopping());
    DeviceStatus status = setup.find();  // back into its configuration state, if it was measuring
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
  } catch (const std::exception&) {  // out of memory
    return DeviceStatus::failed;
  }
}

std::string Device::remark_about(double rate_hz) const {
  const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-6 * b; };
  std::array<char, 200> text{};
  std::string all;
  if (differs(set_.rate_hz(), rate_hz)) {
    (void)std::snprintf(text.data(), text.size(),
                        "it measures at %.4g Hz: of its rates the nearest to %.4g", set_.rate_hz(),
                        rate_hz);
    all = text.data();
  }
  if (set_.sync_out_hz > 0 && differs(set_.sync_out_hz, options_.sync_out_hz)) {
    (void)std::snprintf(text.data(), text.size(), "its SyncOut makes %.4g Hz: the nearest to %.4g",
                        set_.sync_out_hz, options_.sync_out_hz);
    all += (all.empty() ? "" : "; ") + std::string(text.data());
  }
  return all;
}

DeviceTiming Device::timing() const noexcept {
  DeviceTiming t;
  const std::size_t bytes = set_.generation == xbus::Generation::legacy
                                ? xbus::frame_size(set_.layout.payload_size().value_or(0))
                                : 100;
  t.least_delay = options_.processing +
                  Duration::nanoseconds(xbus::wire_time_ns(bytes, baud_ == 0 ? 115200 : baud_));
  t.delay_spread =
      place().latency_timer() + Duration::milliseconds(60);  // a burst of 496 bytes at 115200 baud
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
  std::array<std::uint8_t, Decoder::kMostBytes> bytes{};
  HostStamp last_received = line()->now();
  std::uint64_t frames = decoder_.line_counters().messages;
  for (;;) {
    if (stop_requested()) return DeviceStatus::stopped;
    const LineRead r = line()->read(bytes, kRead);
    if (r.status == DeviceStatus::ok) {
      decoder_.accept(std::span(bytes).first(r.size), r.arrival);
      for (InsReading reading; decoder_.next(&reading);) hand_out(reading, reading.arrival);
      count_decoded();
      if (decoder_.line_counters().messages != frames) last_received = r.arrival;
      frames = decoder_.line_counters().messages;
    } else if (r.status == DeviceStatus::timeout) {
      decoder_.quiet();
    } else if (r.status != DeviceStatus::stopped) {
      return r.status;
    }
    // No whole frame for that long, be it silence or noise.
    if (line()->now() - last_received > kSilent) return DeviceStatus::gone;
  }
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
  // Another one would have another mount: that is for a person to decide.
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
