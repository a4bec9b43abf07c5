#include "drivers/trigger_board/device.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "drivers/trigger_board/requested_configuration.hpp"

namespace vergence::trigger_board {
namespace {

/// Nobody tells these questions to end: they are short.
const std::atomic<bool> kNever{false};

DeviceTiming timing_of(const TriggerConfig& config, Duration byte_time,
                       Duration latency_timer) noexcept {
  constexpr std::int64_t kEventBytes = trigger_event_payload_size + trigger_overhead + 2;
  DeviceTiming t;
  t.least_delay = byte_time * kEventBytes;
  // A report waits for the end of the exposures, at the latest for the next pulse.
  const Duration period =
      Duration::nanoseconds(1'000'000'000'000 / std::max<std::int64_t>(1, config.rate_millihertz));
  t.delay_spread = Duration::milliseconds(4) + latency_timer +
                   (config.feedback_inputs != 0 ? period : Duration{});
  t.resolution = Duration::microseconds(1);
  return t;
}

std::string hex_of(const std::uint8_t (&bytes)[12]) {
  std::string text;
  for (const std::uint8_t b : bytes) {
    std::array<char, 3> two{};
    (void)std::snprintf(two.data(), two.size(), "%02x", static_cast<unsigned>(b));
    text += two.data();
  }
  return text;
}

}  // namespace

Device::Device(std::unique_ptr<LinePlace> place, const Options& options)
    : place_(std::move(place)), options_(options) {
  info_.driver = "board";
  info_.place = place_->name();
}

Device::~Device() { stop(); }

DeviceStatus Device::refuse(DeviceStatus status, std::string sentence) {
  const std::lock_guard lock(last_error_mutex_);
  last_error_ = std::move(sentence);
  return status;
}

std::string Device::last_error() const {
  const std::lock_guard lock(last_error_mutex_);
  return last_error_;
}

Duration Device::byte_time() const noexcept {
  return options_.native_usb || baud_ == 0 ? Duration{}
                                           : Duration::nanoseconds(10'000'000'000 / baud_);
}

DeviceStatus Device::open() {
  LineSettings settings;
  if (const std::uint32_t baud = baud_ != 0 ? baud_ : options_.baud; baud != 0)
    settings.baud = baud;
  DeviceStatus status = DeviceStatus::ok;
  auto line = place_->open(settings, &status);
  const std::lock_guard lock(line_mutex_);
  line_ = std::move(line);
  frames_.attach(line_.get());
  return status;
}

void Device::close_line() noexcept {
  std::unique_ptr<ByteLine> line;
  const std::lock_guard lock(line_mutex_);
  line = std::move(line_);
}

/// Opens the line and asks who is there.
DeviceStatus Device::meet(TriggerInfo* who_is_there) {
  DeviceStatus status = open();
  if (status != DeviceStatus::ok)
    return refuse(status, place_->name() + " cannot be opened: " + std::string(to_string(status)));
  Setup setup(*line_, frames_, stopping_, this);
  TriggerInfo who;
  status = setup.find(options_.native_usb ? line_->baud() : options_.baud, &who);
  if (status != DeviceStatus::ok) return refuse(status, place_->name() + ": " + setup.last_error());
  const std::string serial = hex_of(who.serial);
  // Another board would have other lines: that is for a person to decide.
  if (connected_ && serial != info_.serial)
    return refuse(DeviceStatus::not_found, place_->name() +
                                               ": another trigger board is there now (" + serial +
                                               " instead of " + info_.serial + ")");
  if (!connected_) {
    info_.serial = serial;
    info_.model = "trigger board, firmware " + std::to_string(who.firmware_major) + "." +
                  std::to_string(who.firmware_minor) + "." + std::to_string(who.firmware_patch);
  }
  connected_ = true;
  baud_ = line_->baud();
  *who_is_there = who;
  return DeviceStatus::ok;
}

// ---- the owner's thread

DeviceStatus Device::connect() {
  stop();
  close_line();
  virtual_time_ = place_->pass(Duration{});
  const DeviceStatus status = meet(&identity_);
  if (status != DeviceStatus::ok) close_line();
  return status;
}

DeviceStatus Device::configure(const TriggerConfiguration& requested,
                               TriggerConfiguration* actual) noexcept {
  try {
    stop();
    remark_.clear();
    (void)refuse(DeviceStatus::ok, {});
    if (line_ == nullptr) {
      if (const DeviceStatus s = connect(); s != DeviceStatus::ok) return s;
    }
    std::string sentence;
    TriggerConfig config;
    const DeviceStatus possible =
        wire_configuration(requested, options_, identity_, &config, &sentence);
    if (possible != DeviceStatus::ok) return refuse(possible, std::move(sentence));
    config_ = config;
    mark_ = mark_of(config);
    DeviceStatus status = set_up();
    if (status == DeviceStatus::gone) {  // it was unplugged since: once more, from the port on
      status = connect();
      if (status == DeviceStatus::ok) status = set_up();
    }
    if (status != DeviceStatus::ok) return status;
    configured_ = true;
    timing_ = timing_of(config_, byte_time(), place_->latency_timer());
    remark_ = remark_about(requested, config_);
    if (actual != nullptr) *actual = configuration_of(config_);
    return DeviceStatus::ok;
  } catch (const std::exception&) {  // out of memory
    return DeviceStatus::failed;
  }
}

DeviceStatus Device::set_up() {
  Setup setup(*line_, frames_, kNever, this);
  TriggerStatus status;
  DeviceStatus done = setup.halt(&status);
  if (done == DeviceStatus::ok) done = setup.configure(config_, &status);
  if (done != DeviceStatus::ok) {
    if (done == DeviceStatus::gone) close_line();
    return refuse(done, place_->name() + ": " + setup.last_error());
  }
  return DeviceStatus::ok;
}

DeviceStatus Device::start(Notifier* ready) noexcept {
  if (!configured_) return DeviceStatus::bad_configuration;
  if (!thread_.joinable()) out_.clear();  // of the start before: its pulses are past
  const DeviceStatus status = out_.start(ready);
  if (thread_.joinable() || status != DeviceStatus::ok)
    return status;  // streaming, or gone and perhaps back
  try {
    pause_.store(0, std::memory_order_relaxed);
    told_gone_ = false;
    thread_ = std::thread([this] { work(); });
  } catch (const std::exception&) {
    out_.stop();
    return DeviceStatus::failed;
  }
  starts_.fetch_add(1, std::memory_order_relaxed);
  return DeviceStatus::ok;
}

void Device::stop() noexcept {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(rest_mutex_, line_mutex_);
    stopping_.store(true, std::memory_order_release);
    if (line_ != nullptr) line_->wake();
  }
  stopped_.notify_all();
  out_.stop();
  thread_.join();
  away_.store(false, std::memory_order_relaxed);
  stopping_.store(false, std::memory_order_release);
}

DeviceStatus Device::wait(Duration limit, Pulse* pulse) noexcept {
  Item item;
  const DeviceStatus status = out_.take(limit, &item);
  if (status == DeviceStatus::gone) pulse->arrival = item.arrival;
  if (status == DeviceStatus::ok) *pulse = item.value;
  return status;
}

DeviceStatus Device::pause(std::uint32_t pulses) noexcept {
  if (!out_.streaming()) return DeviceStatus::stopped;
  if (away_.load(std::memory_order_acquire)) return DeviceStatus::gone;
  pause_.fetch_add(pulses,
                   std::memory_order_release);  // the thread looks at least every ping_interval
  return DeviceStatus::ok;
}

TriggerStatistics Device::statistics() const noexcept {
  const BoardStatistics b = board_statistics();
  TriggerStatistics s;
  s.pulses = b.pulses.pulses;
  s.lost = b.pulses.lost;
  s.reboots = b.reboots;
  s.malformed = b.pulses.refused() + b.pulses.exposures_refused + b.line.refused() +
                b.frames_unknown + b.time.refused;
  s.overruns = overruns_.load(std::memory_order_relaxed);
  s.starts = starts_.load(std::memory_order_relaxed);
  return s;
}

BoardStatistics Device::board_statistics() const noexcept {
  const std::lock_guard lock(published_mutex_);
  return published_statistics_;
}

}  // namespace vergence::trigger_board
