#include "app/devices/snap_session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iostream>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/datasets/image_writer.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/devices/image_check.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/signals.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/runtime/version.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPercent = 100, kMilli = 1e3;

void warn(const std::string& message) { std::cerr << "vergence: " << harmless(message) << '\n'; }

/// To so many decimals.
double rounded(double v, int decimals) {
  const double scale = std::pow(10, decimals);
  return std::round(v * scale) / scale;
}

bool is_mock(const Configuration& c) { return c.cameras[0].driver == "mock"; }

/// Everything of one call.
class Snap {
 public:
  explicit Snap(const SnapRequest& request)
      : request_(request),
        configuration_(capture_configuration(request.configuration)),
        names_(camera_names(request.configuration, camera_count(request.configuration))) {}
  ExitCode run() {
    open();
    capture();
    if (!sets_.empty()) write_report();
    return verdict();
  }

 private:
  void open() {
    const Configuration& c = configuration_;
    // A mock: in virtual time, as long as the sets need and a second more.
    const std::optional<double> duration =
        is_mock(c) ? std::optional(1 + request_.count / c.trigger.rate) : std::nullopt;
    devices_ = std::make_unique<DriveDevices>(c, std::vector<std::string>{}, is_mock(c), duration);
    trigger_ = is_mock(c) ? "mock" : to_string(c.cameras[0].trigger);
    for (const std::string& remark : devices_->remarks()) add_remark(remark);
    delivered_.assign(names_.size(), 0);
    disconnected_.assign(names_.size(), false);
  }
  /// Starts the devices, keeps complete sets and stops the devices. Uses only the pulses of the
  /// INS, if it makes them.
  void capture() {
    Acquisition::Options o = devices_->acquisition_options();
    const HostMoment now = moment_now();
    o.tie_stamp = now.day;
    o.tie_host = devices_->mock() != nullptr ? devices_->start() : now.host;
    Acquisition source(devices_->cameras(), devices_->ins(), devices_->trigger(), o);
    start_acquisition(&source);
    {
      using Clock = std::chrono::steady_clock;
      const std::chrono::nanoseconds limit(Duration::seconds(request_.wait_s).ns());
      std::atomic<Clock::time_point> until{Clock::now() + limit};
      // Ends the stream when nothing has come for too long, or a signal has.
      const std::jthread watchdog([&](const std::stop_token& done) {
        constexpr auto kPollInterval = std::chrono::milliseconds(50);
        while (!done.stop_requested() && !signals_.stop_requested() && Clock::now() < until.load())
          std::this_thread::sleep_for(kPollInterval);
        source.stop();
      });
      // The first exposures after a start by software may have old settings.
      int skipped =
          is_mock(configuration_) || configuration_.cameras[0].trigger == CameraTrigger::hardware
              ? 0
              : 2;
      for (Acquired item; !complete() && source.next(&item);) {
        if (const auto* event = std::get_if<DeviceEvent>(&item)) on_event(*event);
        const auto* frame = std::get_if<AcquiredFrame>(&item);
        if (frame == nullptr) continue;
        for (std::size_t k = 0; k < names_.size(); ++k)
          delivered_[k] += frame->set.present[k] ? 1 : 0;
        if (frame->set.complete && skipped-- <= 0) {
          keep(*frame);
          until = Clock::now() + limit;
        }
        source.release(*frame);
      }
    }
    source.stop();
    for (Acquired item; source.next(&item);)
      if (const auto* frame = std::get_if<AcquiredFrame>(&item)) source.release(*frame);
    source.join();
  }
  void on_event(const DeviceEvent& event) {
    const auto k = static_cast<std::size_t>(event.camera);
    if (event.kind == DeviceEvent::Kind::camera_disconnected) disconnected_[k] = true;
    if (event.kind == DeviceEvent::Kind::camera_reconnected) disconnected_[k] = false;
  }
  [[nodiscard]] bool complete() const {
    return sets_.size() == static_cast<std::size_t>(request_.count);
  }
  void add_remark(const std::string& message) {
    remarks_.push_back(message);
    warn(message);
  }
  void keep(const AcquiredFrame& frame) {
    const RigFrame& set = frame.rig;
    std::vector<ImageStatistics> statistics;
    Json images = Json::array();
    for (std::size_t k = 0; k < names_.size(); ++k) {
      const std::string file = file_name(k, sets_.size());
      write_png(request_.out / file, set.images[k]);
      const ImageStatistics f = image_statistics(set.images[k]);
      statistics.push_back(f);
      const DeviceInfo& who = devices_->cameras()[k]->info();
      const CameraSettings& s = configuration_.cameras[k];
      const auto& opened = devices_->opened();
      images.push_back(
          {{"camera", names_[k]},
           {"file", file},
           {"driver", who.driver},
           {"serial", who.serial},
           {"size", {set.images[k].width, set.images[k].height}},
           {"exposure_us", opened.empty()
                               ? s.exposure_us
                               : rounded(opened[k].actual.exposure.to_seconds() * 1e6, 1)},
           {"gain_db", opened.empty() ? s.gain_db : rounded(opened[k].actual.gain_db, 2)},
           {"mean", rounded(f.mean, 2)},
           {"contrast", rounded(f.contrast, 2)},
           {"saturated_percent", rounded(kPercent * f.saturated, 2)},
           {"dark_percent", rounded(kPercent * f.dark, 2)},
           {"sharpness", rounded(f.sharpness, 2)}});
    }
    Json findings = Json::array();
    print(set, statistics);
    for (const ImageIssue& r : check(set, statistics)) {
      unusable_ = unusable_ || r.unusable;
      findings.push_back({{"unusable", r.unusable}, {"message", r.message}});
      warn(r.message);
    }
    if (frame.set.proof == SyncProof::ambiguous)
      warn("the stamps of the cameras do not agree; simultaneous exposure is not verified");
    sets_.push_back({{"stamp_ns", set.stamp.ns()},
                     {"stamp_error_ms", rounded(set.stamp_error.to_seconds() * kMilli, 4)},
                     {"spread_ms", rounded(set.spread.to_seconds() * kMilli, 4)},
                     {"proof", to_string(frame.set.proof)},
                     {"images", images},
                     {"findings", findings}});
  }
  [[nodiscard]] std::vector<ImageIssue> check(
      const RigFrame& set, const std::vector<ImageStatistics>& statistics) const {
    std::vector<ImageIssue> remarks = evaluate_images(names_, statistics);
    for (std::size_t k = 1; k < names_.size(); ++k)
      for (std::size_t i = 0; i < k; ++i)
        if (are_identical(set.images[i], set.images[k]))
          remarks.push_back({true, fmt::format("{} and {} are identical images; if one camera is "
                                               "used twice, set cameras.N.serial",
                                               names_[i], names_[k])});
    return remarks;
  }
  [[nodiscard]] std::string file_name(std::size_t camera, std::size_t set) const {
    return request_.count == 1 ? names_[camera] + ".png"
                               : fmt::format("{}_{:04}.png", names_[camera], set);
  }
  void print(const RigFrame& set, const std::vector<ImageStatistics>& statistics) const {
    std::size_t width = 6;
    for (const std::string& name : names_) width = std::max(width, name.size());
    const std::string title = request_.count == 1 ? "camera" : fmt::format("set {}", sets_.size());
    if (sets_.empty() || request_.count > 1)
      std::cout << fmt::format(
          "{:<{}}  {:>6} {:>8} {:>8} {:>8} {:>9}  {}\n", title, width, "mean", "contrast",
          "white %", "black %", "sharpness",
          fmt::format("exposed within {:.3f} ms", set.spread.to_seconds() * kMilli));
    for (std::size_t k = 0; k < statistics.size(); ++k) {
      const ImageStatistics& f = statistics[k];
      std::cout << fmt::format("{:<{}}  {:>6.1f} {:>8.1f} {:>8.2f} {:>8.2f} {:>9.1f}  {}\n",
                               names_[k], width, f.mean, f.contrast, kPercent * f.saturated,
                               kPercent * f.dark, f.sharpness,
                               (request_.out / file_name(k, sets_.size())).string());
    }
    std::cout.flush();
  }
  void write_report() const {
    const Json all{{"schema_version", kSchemaVersion},
                   {"version", std::string(version())},
                   {"trigger", trigger_},
                   {"notes", remarks_},
                   {"sets", sets_}};
    replace_durably(request_.out / "snap.json",
                    all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  }
  [[nodiscard]] ExitCode verdict() const {
    if (complete()) return unusable_ ? ExitCode::not_usable : ExitCode::done;
    if (const auto stopped = signals_.stop_code()) return *stopped;
    bool silent = false;
    for (std::size_t k = 0; k < delivered_.size(); ++k) {
      if (delivered_[k] > 0) continue;
      silent = true;
      warn(fmt::format(
          "{} {}; check its cable, its power and its trigger ({}.trigger; `free` needs no pulse)",
          camera_title(names_[k], devices_->cameras()[k]->info()),
          disconnected_[k] ? "is disconnected"
                           : fmt::format("sent no image within {:g} s", request_.wait_s),
          fmt::format("cameras.{}", k)));
    }
    if (!silent)
      warn(fmt::format(
          "every camera sent images, but there are {}: {} of {} sets were captured; cameras that "
          "are not triggered together need sync.mode: approximate_time and a sync.tolerance_ms of "
          "half their period",
          sets_.empty() ? "no images within the tolerance" : "too few within the tolerance",
          sets_.size(), request_.count));
    return ExitCode::device_failed;
  }

  const SignalGuard signals_;
  const SnapRequest& request_;
  Configuration configuration_;
  std::vector<std::string> names_;
  std::unique_ptr<DriveDevices> devices_;
  std::string trigger_;
  std::vector<std::string> remarks_;
  Json sets_ = Json::array();
  bool unusable_ = false;
  // Images by camera, also those of incomplete sets.
  std::vector<std::uint64_t> delivered_;
  // Cameras that are disconnected.
  std::vector<bool> disconnected_;
};

}  // namespace

ExitCode capture_images(const SnapRequest& request) {
  Snap snap(request);
  (void)make_session_folder(request.out);
  return snap.run();
}

}  // namespace vergence::app
