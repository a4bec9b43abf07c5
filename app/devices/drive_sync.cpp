#include "app/devices/drive_sync.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <string>

#include <fmt/format.h>

#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

using std::chrono::steady_clock;

DeviceStatus SoftwareTrigger::configure(const TriggerConfiguration& requested,
                                        TriggerConfiguration* actual) noexcept {
  if (!(requested.rate_hz > 0)) return DeviceStatus::bad_configuration;
  if (requested.rate_hz > 1000) return DeviceStatus::unsupported;
  rate_ = requested.rate_hz;
  if (actual != nullptr) *actual = requested;
  return DeviceStatus::ok;
}

DeviceStatus SoftwareTrigger::start(Notifier* ready) noexcept {
  if (!(rate_ > 0)) return DeviceStatus::bad_configuration;
  if (thread_.joinable()) return DeviceStatus::ok;
  try {
    {
      const std::lock_guard lock(mutex_);
      stop_ = false;
      ready_ = ready;
    }
    running_ = true;
    thread_ = std::thread([this] { pace(); });
  } catch (const std::exception&) {
    running_ = false;
    return DeviceStatus::failed;
  }
  ++starts_;
  return DeviceStatus::ok;
}

DeviceStatus SoftwareTrigger::wait(Duration limit, Pulse* pulse) noexcept {
  if (ring_.pop(pulse)) return DeviceStatus::ok;
  if (!running_) return DeviceStatus::stopped;
  if (limit <= Duration{}) return DeviceStatus::timeout;
  std::unique_lock lock(mutex_);
  (void)changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                          [this] { return !ring_.empty() || stop_; });
  if (ring_.pop(pulse)) return DeviceStatus::ok;
  return stop_ ? DeviceStatus::stopped : DeviceStatus::timeout;
}

void SoftwareTrigger::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    ready_ = nullptr;
  }
  running_ = false;
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void SoftwareTrigger::pace() {
  (void)pthread_setname_np(pthread_self(), "vergence-pace");
  const auto period = std::chrono::nanoseconds(Duration::seconds(1 / rate_).ns());
  auto due = steady_clock::now() + period;
  for (std::uint64_t number = 0;; ++number) {
    {
      std::unique_lock lock(mutex_);
      if (changed_.wait_until(lock, due, [this] { return stop_; })) return;
    }
    Pulse pulse;
    pulse.number = number;
    pulse.arrival = HostStamp(steady_clock::now().time_since_epoch().count());
    pulse.edge = DeviceStamp(pulse.arrival.ns());
    for (CameraDevice* camera : cameras_) (void)camera->trigger_once();
    if (ring_.push(pulse))
      ++pulses_;
    else
      ++overruns_;
    {
      const std::lock_guard lock(mutex_);
      changed_.notify_all();
      if (ready_ != nullptr) ready_->notify();
    }
    due += period;
    const auto now = steady_clock::now();
    if (now > due) due = now + period;  // a camera took long to answer: no burst to catch up
  }
}

namespace {

[[noreturn]] void refuse(const Configuration& c, const std::string& why) {
  throw InputError(fmt::format("sync.mode is {}: {}", to_string(c.sync.mode), why));
}

bool is_mock(const CameraSettings& camera) {
  return camera.driver.empty() || camera.driver == "mock";
}

template <class Condition>
void for_each_camera(const Configuration& c, int cameras, const Condition& condition) {
  for (int k = 0; k < cameras; ++k) condition(k, c.cameras[static_cast<std::size_t>(k)]);
}

void check_board(const Configuration& c) {
  if (c.trigger.driver == "none")
    refuse(c,
           "trigger.driver is none, so nothing reports the pulses; set trigger.driver to board, or "
           "sync.mode to frame_counter (not verified)");
}

void check_ins_syncout(const Configuration& c, int cameras) {
  if (c.ins.driver != "xsens")
    refuse(c, fmt::format("ins.driver is {}, which has no SyncOut; it takes xsens, its SyncOut "
                          "wired to the cameras",
                          c.ins.driver));
  if (!(c.ins.sync_out_hz > 0))
    refuse(c, "set ins.sync_out_hz, the pulse rate of the INS, for example to 25");
  if (std::abs(c.ins.sync_out_hz - c.trigger.rate) > 1e-3 * c.trigger.rate)
    refuse(c, fmt::format("trigger.rate is {} and ins.sync_out_hz {}; the INS triggers the "
                          "cameras, so both are one rate",
                          c.trigger.rate, c.ins.sync_out_hz));
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    if (is_mock(s))
      refuse(c, fmt::format("cameras.{}.driver is mock, which no INS triggers; use mode board", k));
  });
}

void check_master(const Configuration& c, int cameras) {
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    if (is_mock(s))
      refuse(c, fmt::format("cameras.{}.driver is mock, whose cameras are triggered by the mock's "
                            "board; use mode board",
                            k));
    if (k == 0 && s.trigger == CameraTrigger::hardware)
      refuse(
          c,
          "cameras.0.trigger is hardware; camera 0 triggers the others, so it is free or software");
    if (k > 0 && s.trigger != CameraTrigger::hardware)
      refuse(c, fmt::format(
                    "cameras.{}.trigger is {}; camera 0's strobe triggers it, so it is hardware", k,
                    to_string(s.trigger)));
  });
}

void check_bus(const Configuration& c, int cameras) {
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    if (s.driver != "iidc-1394")
      refuse(c, fmt::format("cameras.{}.driver is {}; only cameras on one IEEE 1394 bus "
                            "(iidc-1394) share its cycle timer",
                            k, s.driver));
  });
}

void check_ptp(const Configuration& c, int cameras) {
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    if (s.driver != "gige")
      refuse(c, fmt::format("cameras.{}.driver is {}; PTP clocks are those of gige cameras", k,
                            s.driver));
    const auto* options = std::get_if<gige::Options>(&s.options);
    if (options == nullptr || !options->ptp)
      refuse(c, fmt::format(
                    "cameras.{}.options does not contain ptp: on, so its clock is not synchronised",
                    k));
  });
}

void check_side_by_side(const Configuration& c, int cameras) {
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    if (s.half == ImageHalf::whole)
      refuse(c, fmt::format("cameras.{}.image_half is whole, so it has its own frames; with both "
                            "images in one frame it is left or right",
                            k));
  });
}

void check_mode(const Configuration& c, int cameras) {
  switch (c.sync.mode) {
    case SyncMode::board:
      return check_board(c);
    case SyncMode::ins_syncout:
      return check_ins_syncout(c, cameras);
    case SyncMode::master_strobe:
      return check_master(c, cameras);
    case SyncMode::ieee1394_cycle_time:
      return check_bus(c, cameras);
    case SyncMode::ptp:
      return check_ptp(c, cameras);
    case SyncMode::side_by_side:
      return check_side_by_side(c, cameras);
    case SyncMode::frame_counter:
      if (c.cameras[0].trigger == CameraTrigger::free)
        throw InputError(
            "cameras[].trigger is free: nothing makes the cameras expose together, so their "
            "counters cannot pair the images; "
            "trigger them, or set sync.mode to approximate_time (both in one frame: side_by_side)");
      return;
    case SyncMode::approximate_time:
      return;
  }
}

/// A pulse that comes while a camera still exposes is ignored without a word.
void check_exposures(const Configuration& c, int cameras) {
  const double shortest_us = 1e6 / c.trigger.rate - c.trigger.dither_us;
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    const double busy_us = s.trigger_delay_us + s.exposure_us;
    if (busy_us > shortest_us)
      throw InputError(fmt::format(
          "cameras.{}.exposure_us is {}{}, longer than the {:.0f} µs between two "
          "pulses (trigger.rate {}{}): the camera would miss pulses",
          k, s.exposure_us,
          s.trigger_delay_us > 0
              ? fmt::format(" after {} µs of trigger_delay_us", s.trigger_delay_us)
              : "",
          shortest_us, c.trigger.rate,
          c.trigger.dither_us > 0 ? fmt::format(", dither_us {}", c.trigger.dither_us) : ""));
  });
}

/// Default stamp jitter: the V4L2 kernel stamps by the host's clock, the
/// others have their own.
Duration jitter_of(const CameraSettings& s) {
  constexpr double kOwnClock = 20, kHostClock = 1000;  // µs
  const double us = s.stamp_jitter_us > 0 ? s.stamp_jitter_us
                    : s.driver == "v4l2"  ? kHostClock
                                          : kOwnClock;
  return Duration::nanoseconds(std::llround(us * 1e3));
}

Duration microseconds(double us) { return Duration::nanoseconds(std::llround(us * 1e3)); }

/// The MTi-G-700/710 marks the reading that each pulse left with.
bool marks_sync_out(const DeviceInfo& ins) { return ins.model.find('7') != std::string::npos; }

}  // namespace

SyncOptions sync_options(const Configuration& c, int cameras) {
  check_mode(c, cameras);
  check_exposures(c, cameras);
  SyncOptions o;
  o.cameras = cameras;
  o.interval = Duration::seconds(1 / c.trigger.rate);
  o.hold = Duration::seconds(c.sync.timeout_ms * 1e-3);
  o.tolerance = Duration::seconds(c.sync.tolerance_ms * 1e-3);
  o.mode = c.sync.mode;
  for_each_camera(c, cameras, [&](int k, const CameraSettings& s) {
    SyncCameraOptions& camera = o.camera[static_cast<std::size_t>(k)];
    camera.delay = microseconds(s.trigger_delay_us);
    camera.jitter = jitter_of(s);
  });
  if (const char* message = o.validate())
    throw InputError(fmt::format("sync.mode {}: {}", to_string(c.sync.mode), message));
  return o;
}

void fit_to_devices(const Configuration& c, const std::vector<DeviceTiming>& cameras, bool trigger,
                    SyncOptions* options) {
  for (std::size_t k = 0; k < cameras.size(); ++k)
    options->camera[k].resolution = cameras[k].resolution;
  options->align_start = c.cameras[0].trigger == CameraTrigger::hardware &&
                         options->mode == SyncMode::frame_counter &&
                         !trigger;  // the pulses do not wait for us
}

void check_sync_out(const Configuration& c, const DeviceInfo& ins) {
  if (!marks_sync_out(ins))
    refuse(c, fmt::format(
                  "{} tells which pulses it made by no clock that goes on over a gap, so "
                  "nothing could prove the pairs; set sync.mode to frame_counter (not verified), "
                  "or to board with a trigger board",
                  ins_title(ins)));
  constexpr double kBase = 400;  // Hz, over n
  const double nearest = kBase / std::max(1.0, std::round(kBase / c.trigger.rate));
  if (std::abs(nearest - c.trigger.rate) <= 1e-3 * c.trigger.rate) return;
  throw InputError(
      fmt::format("trigger.rate is {}, and {} makes pulses of {:g} Hz / n: set trigger.rate and "
                  "ins.sync_out_hz to {:.6g}",
                  c.trigger.rate, ins_title(ins), kBase, nearest));
}

TriggerConfiguration trigger_configuration(const Configuration& c, int cameras) {
  const auto all = static_cast<std::uint8_t>((1U << static_cast<unsigned>(cameras)) - 1U);
  TriggerConfiguration t;
  t.rate_hz = c.trigger.rate;
  t.width = microseconds(c.trigger.width_us);
  t.vary = microseconds(c.trigger.dither_us);
  t.lines = c.trigger.lines == 0 ? all : static_cast<std::uint8_t>(c.trigger.lines);
  t.active_low = static_cast<std::uint8_t>(c.trigger.active_low);
  t.feedback = static_cast<std::uint8_t>(c.trigger.feedback);
  t.feedback_active_low = static_cast<std::uint8_t>(c.trigger.feedback_active_low);
  if ((t.lines & all) != all)
    throw InputError(
        fmt::format("trigger.lines is {}, a mask that leaves out the line of a camera; 0 takes one "
                    "line for each of the {}",
                    c.trigger.lines, cameras));
  const double period_us = 1e6 / c.trigger.rate;
  if (c.trigger.dither_us * 2 > period_us)
    throw InputError(fmt::format(
        "trigger.dither_us is {}, more than half of the {:.0f} µs between two pulses; a "
        "twentieth is plenty",
        c.trigger.dither_us, period_us));
  if (c.trigger.width_us + c.trigger.dither_us >= period_us)
    throw InputError(fmt::format(
        "trigger.width_us is {}: a pulse would last until the next one, {:.0f} µs later",
        c.trigger.width_us, period_us - c.trigger.dither_us));
  return t;
}

const char* proof_message(SyncMode mode) noexcept {
  switch (mode) {
    case SyncMode::board:
      return "pairs are verified by the board's numbered pulses";
    case SyncMode::ins_syncout:
      return "pairs are verified by the numbered pulses of the INS's SyncOut";
    case SyncMode::master_strobe:
      return "pairs are verified by the exposures of camera 0, which triggers the others";
    case SyncMode::ieee1394_cycle_time:
      return "pairs are verified by stamps of one bus clock";
    case SyncMode::ptp:
      return "pairs are verified by stamps of one PTP clock";
    case SyncMode::side_by_side:
      return "pairs are verified: both images are in one frame";
    case SyncMode::frame_counter:
      return "pairing is not verified: sync.mode is frame_counter (counters and stamps are "
             "compared)";
    case SyncMode::approximate_time:
      return "pairing is not verified: sync.mode is approximate_time (nearest stamps)";
  }
  return "";
}

}  // namespace vergence::app
