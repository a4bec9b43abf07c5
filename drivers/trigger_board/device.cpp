#include "drivers/trigger_board/device.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "drivers/format_text.hpp"
#include "drivers/trigger_board/setup.hpp"

namespace vergence::trigger_board {
namespace {

/// These requests are short and not cancellable.
const std::atomic<bool> kNever{false};

DeviceTiming make_timing(const TriggerConfig& config, Duration byte_time,
                         Duration latency_timer) noexcept {
  constexpr std::int64_t kReportBytes = trigger_event_payload_size + trigger_overhead + 2;
  DeviceTiming t;
  t.min_delay = byte_time * kReportBytes;
  // A report is sent after the exposures have ended, at the latest with the next pulse.
  const Duration period =
      Duration::nanoseconds(1'000'000'000'000 / std::max<std::int64_t>(1, config.rate_millihertz));
  t.delay_spread = Duration::milliseconds(4) + latency_timer +
                   (config.feedback_inputs != 0 ? period : Duration{});
  t.resolution = Duration::microseconds(1);
  return t;
}

std::string to_hex(const std::uint8_t (&bytes)[12]) {
  std::string text;
  for (const std::uint8_t b : bytes) text += format_text("%02x", static_cast<unsigned>(b));
  return text;
}

}  // namespace

Device::Device(std::unique_ptr<SerialLinkFactory> place, const Options& options)
    : SerialDevice(std::move(place), "vergence-board"),
      options_(options),
      receiver_(pause_, [this](const Pulse& pulse) { hand_out(pulse, pulse.arrival); }) {
  info_.driver = "board";
  info_.place = this->place().name();
}

Device::~Device() { stop(); }

Duration Device::byte_time() const noexcept {
  return options_.native_usb || baud_ == 0 ? Duration{}
                                           : Duration::nanoseconds(10'000'000'000 / baud_);
}

DeviceStatus Device::open() {
  LineSettings settings;
  if (const std::uint32_t baud = baud_ != 0 ? baud_ : options_.baud; baud != 0)
    settings.baud = baud;
  const DeviceStatus status = open_line(settings);
  frames_.attach(line());
  return status;
}

/// Opens the link and identifies the trigger board.
DeviceStatus Device::meet(TriggerInfo* who_is_there) {
  DeviceStatus status = open();
  if (status != DeviceStatus::ok)
    return last_error_.refuse(
        status, place().name() + " cannot be opened: " + std::string(to_string(status)));
  Setup setup(*line(), frames_, stopping(), &receiver_);
  TriggerInfo who;
  status = setup.find(options_.native_usb ? line()->baud() : options_.baud, &who);
  if (status != DeviceStatus::ok)
    return last_error_.refuse(status, place().name() + ": " + setup.last_error());
  const std::string serial = to_hex(who.serial);
  // Another trigger board may be wired differently, which the user has to check.
  if (connected_ && serial != info_.serial)
    return last_error_.refuse(DeviceStatus::not_found,
                              place().name() + ": another trigger board is connected now (" +
                                  serial + " instead of " + info_.serial + ")");
  if (!connected_) {
    info_.serial = serial;
    info_.model = "trigger board, firmware " + std::to_string(who.firmware_major) + "." +
                  std::to_string(who.firmware_minor) + "." + std::to_string(who.firmware_patch);
  }
  connected_ = true;
  baud_ = line()->baud();
  *who_is_there = who;
  return DeviceStatus::ok;
}

// ---- the owner's thread

DeviceStatus Device::connect() {
  stop();
  close_line();
  query_virtual_time();
  const DeviceStatus status = meet(&identity_);
  if (status != DeviceStatus::ok) close_line();
  return status;
}

DeviceStatus Device::configure(const TriggerConfiguration& requested,
                               TriggerConfiguration* actual) noexcept {
  try {
    stop();
    remark_.clear();
    last_error_.clear();
    if (line() == nullptr) {
      if (const DeviceStatus s = connect(); s != DeviceStatus::ok) return s;
    }
    std::string message;
    TriggerConfig config;
    const DeviceStatus possible =
        wire_configuration(requested, options_, identity_, &config, &message);
    if (possible != DeviceStatus::ok) return last_error_.refuse(possible, std::move(message));
    config_ = config;
    mark_ = configuration_mark(config);
    DeviceStatus status = set_up();
    // It was disconnected meanwhile; tries once more, beginning with the port.
    if (status == DeviceStatus::disconnected) {
      status = connect();
      if (status == DeviceStatus::ok) status = set_up();
    }
    if (status != DeviceStatus::ok) return status;
    configured_ = true;
    timing_ = make_timing(config_, byte_time(), place().latency_timer());
    remark_ = remark_about(requested, config_);
    if (actual != nullptr) *actual = to_configuration(config_);
    return DeviceStatus::ok;
    // Out of memory.
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus Device::set_up() {
  Setup setup(*line(), frames_, kNever, &receiver_);
  TriggerStatus status;
  DeviceStatus done = setup.halt(&status);
  if (done == DeviceStatus::ok) done = setup.configure(config_, &status);
  if (done != DeviceStatus::ok) {
    if (done == DeviceStatus::disconnected) close_line();
    return last_error_.refuse(done, place().name() + ": " + setup.last_error());
  }
  return DeviceStatus::ok;
}

DeviceStatus Device::start(Notifier* ready) noexcept {
  if (!configured_) return DeviceStatus::bad_configuration;
  if (!running()) pause_.drop_new();
  return start_thread(ready);
}

void Device::stop() noexcept { stop_thread(); }

DeviceStatus Device::wait(Duration limit, Pulse* pulse) noexcept { return pop(limit, pulse); }

DeviceStatus Device::pause(std::uint32_t pulses) noexcept {
  if (!streaming()) return DeviceStatus::stopped;
  if (away()) return DeviceStatus::disconnected;
  // The thread checks for it at least every ping_interval.
  pause_.add(pulses);
  return DeviceStatus::ok;
}

TriggerStatistics Device::statistics() const noexcept {
  TriggerStatistics s = statistics_.get();
  s.overruns = overruns();
  s.starts = starts();
  return s;
}

}  // namespace vergence::trigger_board
