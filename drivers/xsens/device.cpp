#include "drivers/xsens/device.hpp"

#include <pthread.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <utility>

namespace vergence::xsens {
namespace {

constexpr Duration kRead = Duration::milliseconds(200);
constexpr Duration kAgain =
    Duration::milliseconds(500);  // between attempts to open a line that is gone

}  // namespace

Device::Device(std::unique_ptr<LinePlace> place, const Options& options)
    : place_(std::move(place)), options_(options) {
  info_.driver = "xsens";
  info_.place = place_->name();
}

Device::~Device() { stop(); }

// ---- the owner's thread

DeviceStatus Device::open() {
  LineSettings settings;
  if (baud_ != 0) settings.baud = baud_;
  // MTi-G built before 2008 want two stop bits; a receiver that wants one takes the second for idle
  // line.
  settings.stop_bits = 2;
  DeviceStatus status = DeviceStatus::ok;
  auto line = place_->open(settings, &status);
  const std::lock_guard lock(line_mutex_);
  line_ = std::move(line);
  return status;
}

void Device::close_line() noexcept {
  std::unique_ptr<ByteLine> line;
  const std::lock_guard lock(line_mutex_);
  line = std::move(line_);
}

DeviceStatus Device::connect() {
  stop();
  close_line();
  virtual_time_ = place_->pass(Duration{});
  DeviceStatus status = open();
  if (status != DeviceStatus::ok) {
    last_error_ = place_->name() + " cannot be opened: " + std::string(to_string(status));
    return status;
  }
  Setup setup(*line_, options_, stopping_);
  status = setup.find();
  if (status == DeviceStatus::ok) status = setup.identify(&identity_);
  if (status != DeviceStatus::ok) {
    last_error_ = place_->name() + ": " + setup.last_error();
    close_line();
    return status;
  }
  baud_ = line_->baud();
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
    if (line_ == nullptr) {
      if (const DeviceStatus s = connect(); s != DeviceStatus::ok) return s;
    }
    Setup setup(*line_, options_, stopping_);
    DeviceStatus status = setup.find();  // back into its configuration state, if it was measuring
    StreamSettings set;
    if (status == DeviceStatus::ok) status = setup.set(identity_, rate_hz, &set);
    if (status != DeviceStatus::ok) {
      last_error_ = setup.last_error();
      return status;
    }
    set_ = set;
    baud_ = line_->baud();
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
      place_->latency_timer() + Duration::milliseconds(60);  // a burst of 496 bytes at 115200 baud
  t.resolution = Duration::microseconds(100);
  return t;
}

DeviceStatus Device::start(Notifier* ready) noexcept {
  if (!configured_) return DeviceStatus::bad_configuration;
  if (thread_.joinable()) return out_.start(ready);  // streaming, or gone and perhaps back
  out_.clear();                                      // of the start before: its readings are past
  const DeviceStatus status = out_.start(ready);
  if (status != DeviceStatus::ok) return status;
  try {
    stopping_.store(false, std::memory_order_release);
    thread_ = std::thread([this] { work(); });
  } catch (const std::exception&) {
    out_.stop();
    return DeviceStatus::failed;
  }
  starts_.fetch_add(1, std::memory_order_relaxed);
  return DeviceStatus::ok;
}

void Device::stop() noexcept {
  {
    const std::scoped_lock lock(pause_mutex_, line_mutex_);
    stopping_.store(true, std::memory_order_release);
    if (line_ != nullptr && thread_.joinable()) line_->wake();
  }
  stopped_.notify_all();
  out_.stop();
  if (thread_.joinable()) thread_.join();
  stopping_.store(false, std::memory_order_release);
}

DeviceStatus Device::wait(Duration limit, InsReading* reading) noexcept {
  Item item;
  const DeviceStatus status = out_.take(limit, &item);
  if (status == DeviceStatus::gone) reading->arrival = item.arrival;
  if (status != DeviceStatus::ok) return status;
  *reading = item.value;
  delivered_.fetch_add(1, std::memory_order_relaxed);
  return DeviceStatus::ok;
}

InsStatistics Device::statistics() const noexcept {
  InsStatistics s;
  s.delivered = delivered_.load(std::memory_order_relaxed);
  s.lost = lost_.load(std::memory_order_relaxed);
  s.malformed = malformed_.load(std::memory_order_relaxed);
  s.restarts = restarts_.load(std::memory_order_relaxed);
  s.overruns = overruns_.load(std::memory_order_relaxed);
  s.starts = starts_.load(std::memory_order_relaxed);
  return s;
}

// ---- the device's thread

void Device::work() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-ins");
  bool told_gone = false;
  while (!stopping_.load(std::memory_order_acquire)) {
    DeviceStatus status = line_ != nullptr ? measure() : DeviceStatus::gone;
    HostStamp when = line_ != nullptr ? line_->now() : HostStamp{};
    if (status == DeviceStatus::ok) {
      if (std::exchange(told_gone, false)) hand_out({Item::What::back, when, {}}, true);
      status = read_on();
      if (line_ != nullptr) when = line_->now();
    }
    if (status == DeviceStatus::stopped) return;
    if (status == DeviceStatus::ended) {
      hand_out({Item::What::end, when, {}}, true);
      return;
    }
    if (!std::exchange(told_gone, true)) hand_out({Item::What::gone, when, {}}, true);
    if (!come_back()) return;
  }
}

DeviceStatus Device::measure() noexcept {
  try {
    Setup setup(*line_, options_, stopping_);
    DeviceStatus status = setup.find();
    if (status == DeviceStatus::ok) status = setup.measure();
    if (status != DeviceStatus::ok) return status;
    decoder_.begin(set_, line_->baud(), options_.processing);
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus Device::read_on() noexcept {
  std::array<std::uint8_t, Decoder::kMostBytes> bytes{};
  HostStamp heard = line_->now();
  std::uint64_t frames = decoder_.line_counters().messages;
  for (;;) {
    if (stopping_.load(std::memory_order_acquire)) return DeviceStatus::stopped;
    const LineRead r = line_->read(bytes, kRead);
    if (r.status == DeviceStatus::ok) {
      decoder_.accept(std::span(bytes).first(r.size), r.arrival);
      for (InsReading reading; decoder_.next(&reading);)
        hand_out({Item::What::item, reading.arrival, reading}, false);
      count();
      if (decoder_.line_counters().messages != frames) heard = r.arrival;
      frames = decoder_.line_counters().messages;
    } else if (r.status == DeviceStatus::timeout) {
      decoder_.quiet();
    } else if (r.status != DeviceStatus::stopped) {
      return r.status;
    }
    // No whole frame for that long, be it silence or noise.
    if (line_->now() - heard > kSilent) return DeviceStatus::gone;
  }
}

/// Opens and sets the device again, as often as it takes. False: stopped.
bool Device::come_back() noexcept {
  close_line();
  while (!stopping_.load(std::memory_order_acquire)) {
    if (bring_up() == DeviceStatus::ok) return true;
    close_line();
    pause(kAgain);
  }
  return false;
}

DeviceStatus Device::bring_up() {
  try {
    if (const DeviceStatus s = open(); s != DeviceStatus::ok) return s;
    Setup setup(*line_, options_, stopping_);
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
    baud_ = line_->baud();
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

void Device::pause(Duration time) noexcept {
  if (place_->pass(time)) return;
  std::unique_lock lock(pause_mutex_);
  (void)stopped_.wait_for(lock, std::chrono::nanoseconds(time.ns()),
                          [this] { return stopping_.load(std::memory_order_acquire); });
}

void Device::hand_out(const Item& item, bool always) noexcept {
  while (!out_.push(item)) {
    if (!virtual_time_ && !always) {
      overruns_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    out_.wait_for_room();
    if (stopping_.load(std::memory_order_acquire)) return;
  }
}

void Device::count() noexcept {
  const DecoderCounters& c = decoder_.counters();
  lost_.store(c.lost, std::memory_order_relaxed);
  malformed_.store(c.malformed + decoder_.line_counters().checksum_wrong,
                   std::memory_order_relaxed);
  restarts_.store(c.restarts, std::memory_order_relaxed);
}

}  // namespace vergence::xsens
