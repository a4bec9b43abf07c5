#include "app/devices/drive_sync.hpp"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
#include "core/memory/ring.hpp"

namespace vergence::app {

using std::chrono::steady_clock;

namespace {

class SoftwareTrigger final : public TriggerDevice {
 public:
  explicit SoftwareTrigger(std::vector<CameraDevice*> cameras) : cameras_(std::move(cameras)) {}
  ~SoftwareTrigger() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const TriggerConfiguration& requested,
                         TriggerConfiguration* actual) noexcept override {
    if (!(requested.rate_hz > 0)) return DeviceStatus::bad_configuration;
    if (requested.rate_hz > 1000) return DeviceStatus::unsupported;
    rate_ = requested.rate_hz;
    if (actual != nullptr) *actual = requested;
    return DeviceStatus::ok;
  }

  DeviceStatus start(Notifier* ready) noexcept override {
    if (!(rate_ > 0)) return DeviceStatus::bad_configuration;
    if (thread_.joinable()) return DeviceStatus::ok;
    const std::lock_guard lock(mutex_);
    try {
      thread_ = std::thread([this] { pace(); });
    } catch (const std::exception&) {
      return DeviceStatus::failed;
    }
    stop_ = false;
    ready_ = ready;
    ++starts_;
    return DeviceStatus::ok;
  }

  DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override {
    std::unique_lock lock(mutex_);
    (void)changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                            [this] { return !ring_.empty() || stop_; });
    if (ring_.pop(pulse)) return DeviceStatus::ok;
    return stop_ ? DeviceStatus::stopped : DeviceStatus::timeout;
  }

  void stop() noexcept override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
      ready_ = nullptr;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  TriggerStatistics statistics() const noexcept override {
    return {.pulses = pulses_.load(), .overruns = overruns_.load(), .starts = starts_.load()};
  }

 private:
  void pace() {
    (void)pthread_setname_np(pthread_self(), "vergence-pace");
    const auto period = std::chrono::nanoseconds(Duration::seconds(1 / rate_).ns());
    auto due = steady_clock::now() + period;
    for (std::uint64_t number = 0;; ++number) {
      {
        std::unique_lock lock(mutex_);
        if (changed_.wait_until(lock, due, [this] { return stop_; })) return;
      }
      Pulse pulse{.number = number,
                  .arrival = HostStamp(steady_clock::now().time_since_epoch().count())};
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
      // After a slow answer of a camera the schedule restarts, which avoids a burst.
      if (now > due) due = now + period;
    }
  }

  DeviceInfo info_{"software", "", "commands over the cameras' own links", ""};
  std::vector<CameraDevice*> cameras_;
  double rate_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_. True unless the thread runs.
  bool stop_ = true;
  // Guarded by mutex_.
  Notifier* ready_ = nullptr;
  Ring<Pulse, 64> ring_;
  std::atomic<std::uint64_t> pulses_{0}, overruns_{0}, starts_{0};
  std::thread thread_;
};

[[noreturn]] void refuse(const Configuration& c, const std::string& why) {
  throw InputError("sync.mode is {}: {}", to_string(c.sync.mode), why);
}

bool is_mock(const CameraSettings& camera) {
  return camera.driver.empty() || camera.driver == "mock";
}

void check_ins_syncout(const Configuration& c) {
  if (c.ins.driver != "xsens")
    refuse(
        c,
        fmt::format(
            "ins.driver is {}, which has no SyncOut; use xsens with SyncOut wired to the cameras",
            c.ins.driver));
  if (!(c.ins.sync_out_hz > 0))
    refuse(c, "set ins.sync_out_hz, the pulse rate of the INS, for example to 25");
  if (std::abs(c.ins.sync_out_hz - c.trigger.rate) > 1e-3 * c.trigger.rate)
    refuse(c, fmt::format("trigger.rate is {} and ins.sync_out_hz {}; the INS triggers the "
                          "cameras, so set both to one rate",
                          c.trigger.rate, c.ins.sync_out_hz));
}

/// Why camera k does not fit the mode, a message after `cameras.k.`; empty: it does.
std::string misfit(SyncMode mode, int k, const CameraSettings& s) {
  const auto* gige = std::get_if<gige::Options>(&s.options);
  switch (mode) {
    case SyncMode::ins_syncout:
      return is_mock(s) ? "driver is mock, which no INS triggers; use sync.mode board" : "";
    case SyncMode::master_strobe:
      if (is_mock(s))
        return "driver is mock, whose cameras are triggered by a simulated trigger board; use "
               "sync.mode board";
      if (k == 0 && s.trigger == CameraTrigger::hardware)
        return "trigger is hardware, but camera 0 triggers the others; set it to free or software";
      if (k > 0 && s.trigger != CameraTrigger::hardware)
        return fmt::format(
            "trigger is {}, but the strobe of camera 0 triggers this camera; set it to hardware",
            to_string(s.trigger));
      return "";
    case SyncMode::ieee1394_cycle_time:
      if (s.driver == "iidc-1394") return "";
      return fmt::format(
          "driver is {}, but only cameras on one IEEE 1394 bus share a cycle timer; use iidc-1394 "
          "or another sync.mode",
          s.driver);
    case SyncMode::ptp:
      if (s.driver != "gige")
        return fmt::format(
            "driver is {}, but only gige cameras have PTP clocks; use gige or another sync.mode",
            s.driver);
      return gige != nullptr && gige->ptp
                 ? ""
                 : "options lacks ptp: on, so the camera's clock is not synchronised; add it";
    case SyncMode::side_by_side:
      if (s.half != ImageHalf::whole) return "";
      return "image_half is whole; with both images in one frame set it to left or right";
    case SyncMode::board:
    case SyncMode::frame_counter:
    case SyncMode::approximate_time:
      return "";
  }
  return "";
}

void check_mode(const Configuration& c, int cameras) {
  if (c.sync.mode == SyncMode::board && c.trigger.driver == "none")
    refuse(c,
           "trigger.driver is none, so nothing reports the pulses; set trigger.driver to board, or "
           "sync.mode to frame_counter (not verified)");
  if (c.sync.mode == SyncMode::ins_syncout) check_ins_syncout(c);
  if (c.sync.mode == SyncMode::frame_counter && c.cameras[0].trigger == CameraTrigger::free)
    throw InputError(
        "cameras.N.trigger is free, so the cameras do not expose together and their counters "
        "cannot pair the images; trigger them, or set sync.mode to approximate_time (both in one "
        "frame: side_by_side)");
  for (int k = 0; k < cameras; ++k) {
    const std::string why = misfit(c.sync.mode, k, c.cameras[static_cast<std::size_t>(k)]);
    if (!why.empty()) refuse(c, fmt::format("cameras.{}.{}", k, why));
  }
}

/// A pulse that comes while a camera still exposes is ignored without a word.
void check_exposures(const Configuration& c, int cameras) {
  const double shortest_us = 1e6 / c.trigger.rate - c.trigger.dither_us;
  for (int k = 0; k < cameras; ++k) {
    const CameraSettings& s = c.cameras[static_cast<std::size_t>(k)];
    const double busy_us = s.trigger_delay_us + s.exposure_us;
    if (busy_us > shortest_us)
      throw InputError(
          "cameras.{}.exposure_us is {}{}, longer than the {:.0f} µs between two pulses "
          "(trigger.rate {}{}), so the camera would miss pulses; lower exposure_us or trigger.rate",
          k, s.exposure_us,
          s.trigger_delay_us > 0
              ? fmt::format(" after {} µs of trigger_delay_us", s.trigger_delay_us)
              : "",
          shortest_us, c.trigger.rate,
          c.trigger.dither_us > 0 ? fmt::format(", dither_us {}", c.trigger.dither_us) : "");
  }
}

/// Default stamp jitter: the V4L2 kernel stamps by the host's clock, the
/// others have their own.
Duration max_jitter(const CameraSettings& s) {
  // Uncertainties in µs.
  constexpr double kOwnClock = 20, kHostClock = 1000;
  return microseconds(s.stamp_jitter_us > 0 ? s.stamp_jitter_us
                      : s.driver == "v4l2"  ? kHostClock
                                            : kOwnClock);
}

/// The MTi-G-700/710 marks the reading that each pulse left with.
bool marks_sync_out(const DeviceInfo& ins) { return ins.model.find('7') != std::string::npos; }

}  // namespace

std::unique_ptr<TriggerDevice> make_software_trigger(std::vector<CameraDevice*> cameras) {
  return std::make_unique<SoftwareTrigger>(std::move(cameras));
}

SyncOptions sync_options(const Configuration& c, int cameras) {
  check_mode(c, cameras);
  check_exposures(c, cameras);
  SyncOptions o{.cameras = cameras,
                .interval = Duration::seconds(1 / c.trigger.rate),
                .hold = Duration::seconds(c.sync.timeout_ms * 1e-3),
                .mode = c.sync.mode,
                .tolerance = Duration::seconds(c.sync.tolerance_ms * 1e-3)};
  for (std::size_t k = 0; k < static_cast<std::size_t>(cameras); ++k) {
    o.camera[k].delay = microseconds(c.cameras[k].trigger_delay_us);
    o.camera[k].jitter = max_jitter(c.cameras[k]);
  }
  if (const char* message = o.validate())
    throw InputError("sync.mode {}: {}", to_string(c.sync.mode), message);
  return o;
}

void fit_to_devices(const Configuration& c, const std::vector<DeviceTiming>& cameras, bool trigger,
                    SyncOptions* options) {
  for (std::size_t k = 0; k < cameras.size(); ++k)
    options->camera[k].resolution = cameras[k].resolution;
  // Pulses of the trigger board do not wait for the host.
  options->align_start = c.cameras[0].trigger == CameraTrigger::hardware &&
                         options->mode == SyncMode::frame_counter && !trigger;
}

void check_sync_out(const Configuration& c, const DeviceInfo& ins) {
  if (!marks_sync_out(ins))
    refuse(c, fmt::format(
                  "{} has no clock that continues across a gap, so pairs cannot be verified; set "
                  "sync.mode to frame_counter (not verified), or to board with a trigger board",
                  ins_title(ins)));
  // Base frequency in Hz, divided by n.
  constexpr double kBase = 400;
  const double nearest = kBase / std::max(1.0, std::round(kBase / c.trigger.rate));
  if (std::abs(nearest - c.trigger.rate) <= 1e-3 * c.trigger.rate) return;
  throw InputError(
      "trigger.rate is {}, but {} generates pulses of {:g} Hz / n; set trigger.rate and "
      "ins.sync_out_hz to {:.6g}",
      c.trigger.rate, ins_title(ins), kBase, nearest);
}

TriggerConfiguration trigger_configuration(const Configuration& c, int cameras) {
  const auto all = static_cast<std::uint8_t>((1U << static_cast<unsigned>(cameras)) - 1U);
  TriggerConfiguration t{
      .rate_hz = c.trigger.rate,
      .width = microseconds(c.trigger.width_us),
      .vary = microseconds(c.trigger.dither_us),
      .lines = c.trigger.lines == 0 ? all : static_cast<std::uint8_t>(c.trigger.lines),
      .active_low = static_cast<std::uint8_t>(c.trigger.active_low),
      .feedback = static_cast<std::uint8_t>(c.trigger.feedback),
      .feedback_active_low = static_cast<std::uint8_t>(c.trigger.feedback_active_low)};
  if ((t.lines & all) != all)
    throw InputError(
        "trigger.lines is {}, a bit mask without the line of a camera; set it to 0 for one line "
        "for each of the {}",
        c.trigger.lines, cameras);
  const double period_us = 1e6 / c.trigger.rate;
  if (c.trigger.dither_us * 2 > period_us)
    throw InputError(
        "trigger.dither_us is {}, more than half of the {:.0f} µs between two pulses; a twentieth "
        "is sufficient",
        c.trigger.dither_us, period_us);
  if (c.trigger.width_us + c.trigger.dither_us >= period_us)
    throw InputError(
        "trigger.width_us is {}, so a pulse would last until the next one, {:.0f} µs later; lower "
        "it",
        c.trigger.width_us, period_us - c.trigger.dither_us);
  return t;
}

const char* proof_message(SyncMode mode) noexcept {
  constexpr std::array kMessages{
      std::pair{SyncMode::board, "pairs are verified by the board's numbered pulses"},
      std::pair{SyncMode::ins_syncout,
                "pairs are verified by the numbered pulses of the INS's SyncOut"},
      std::pair{SyncMode::master_strobe,
                "pairs are verified by the exposures of camera 0, which triggers the others"},
      std::pair{SyncMode::ieee1394_cycle_time, "pairs are verified by stamps of one bus clock"},
      std::pair{SyncMode::ptp, "pairs are verified by stamps of one PTP clock"},
      std::pair{SyncMode::side_by_side, "pairs are verified: both images are in one frame"},
      std::pair{SyncMode::frame_counter,
                "pairing is not verified: sync.mode is frame_counter (counters and stamps are "
                "compared)"}};
  for (const auto& [known, message] : kMessages)
    if (known == mode) return message;
  return "pairing is not verified: sync.mode is approximate_time (nearest stamps)";
}

}  // namespace vergence::app
