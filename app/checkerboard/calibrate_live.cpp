
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "app/checkerboard/board_detector.hpp"
#include "app/checkerboard/calibrate_session.hpp"
#include "app/checkerboard/view_collector.hpp"
#include "app/datasets/image_writer.hpp"
#include "app/devices/capture_result.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/signals.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

const char* phrase(OfferResult verdict) {
  switch (verdict) {
    case OfferResult::taken:
      return "taken";
    case OfferResult::not_seen:
      return "board not seen by both";
    case OfferResult::moving:
      return "hold it still";
    case OfferResult::nothing_new:
      return "seen that";
  }
  return "";
}

/// A folder that is there and has nothing in it yet.
void make_empty_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder, error))
    throw InputError(folder.string() +
                     ": cannot be created; --keep-views needs a new or empty directory");
  if (!fs::is_empty(folder, error))
    throw InputError(folder.string() +
                     ": is not empty; --keep-views needs a new or empty directory");
}

/// Sets of images from the cameras, the board in them, until nothing is missing. Its thread looks,
/// the caller's watches.
class Collection {
 public:
  Collection(const CalibrateRequest& request, const CalibratedRig& rig, double focal_px,
             Acquisition* source)
      : request_(request),
        rig_(rig),
        source_(source),
        collector_(Coverage(request.board, rig.names, rig.sizes, focal_px), rig.sizes[0].width) {}

  /// Until the source ends, nothing is missing, or a signal comes. Throws what looking threw.
  void run(const SignalGuard& signals, Progress* progress) {
    std::thread detecting([this] { detect_loop(); });
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, std::chrono::milliseconds(50), [this] { return done_; })) {
      if (signals.stop_requested()) source_->stop();
      show_progress(progress);
    }
    show_progress(progress);
    lock.unlock();
    detecting.join();
    if (failure_) std::rethrow_exception(failure_);
  }
  [[nodiscard]] const std::vector<BoardView>& views() const noexcept { return collector_.views(); }
  [[nodiscard]] bool complete() const { return collector_.complete(); }

 private:
  void detect_loop() {
    try {
      detect_all();
    } catch (...) {  // out of a thread it would end the program
      failure_ = std::current_exception();
      source_->stop();
    }
    const std::lock_guard lock(mutex_);
    done_ = true;
    changed_.notify_one();
  }

  void detect_all() {
    for (Acquired item; source_->next(&item);) {
      if (const auto* event = std::get_if<DeviceEvent>(&item)) on_event(*event);
      const auto* frame = std::get_if<AcquiredFrame>(&item);
      if (frame == nullptr) continue;
      offer(frame->rig);
      source_->release(*frame);
      if (complete_) source_->stop();
    }
  }

  void on_event(const DeviceEvent& event) {
    const bool gone = event.kind == DeviceEvent::Kind::camera_disconnected;
    if (!gone && event.kind != DeviceEvent::Kind::camera_reconnected) return;
    const std::lock_guard lock(mutex_);
    messages_.push_back(
        fmt::format("camera {} is {}", event.camera, gone ? "gone; waiting for it" : "back"));
  }

  void offer(const RigFrame& frame) {
    BoardView seen;
    seen.name = fmt::format("view {}", collector_.views().size());
    for (int k = 0; k < static_cast<int>(rig_.sizes.size()); ++k) {
      const auto at = static_cast<std::size_t>(k);
      seen.corners[at] =
          find_board(frame.images[at], request_.board, BoardSearch::quick, seen.corners[0]);
    }
    const std::size_t number = collector_.views().size();
    const OfferResult verdict = collector_.offer(seen);
    if (verdict == OfferResult::taken && request_.keep_views) keep(frame, number);
    const auto needs = collector_.coverage().needs();
    complete_ = needs.empty();
    const std::lock_guard lock(mutex_);
    ++sets_;
    activity_ =
        fmt::format("{} views · {}{}", collector_.views().size(), phrase(verdict),
                    needs.empty() ? "" : fmt::format(" · missing: {}", fmt::join(needs, "; ")));
  }

  void keep(const RigFrame& frame, std::size_t number) {
    for (int k = 0; k < static_cast<int>(rig_.sizes.size()); ++k) {
      const ImageView image = frame.images[static_cast<std::size_t>(k)];
      if (image.empty()) continue;
      const fs::path file =
          *request_.keep_views /
          fmt::format("{}_{:03}.png", rig_.names[static_cast<std::size_t>(k)], number);
      try {
        write_png(file, image);
        continue;
      } catch (const InputError&) {  // said below
      }
      const std::lock_guard lock(mutex_);
      messages_.push_back(file.string() + ": cannot be written; the view is used all the same");
    }
  }

  /// Under the lock.
  void show_progress(Progress* progress) {
    for (const std::string& message : messages_) progress->print("vergence: " + message);
    messages_.clear();
    ProgressState state;
    state.state = "calibrate";
    state.frame = sets_;
    state.activity = activity_;
    progress->update(state);
  }

  const CalibrateRequest& request_;
  const CalibratedRig& rig_;
  Acquisition* source_;
  ViewCollector collector_;       // of the looking thread, until it has ended
  bool complete_ = false;         // likewise
  std::exception_ptr failure_{};  // likewise

  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::uint64_t sets_ = 0;
  std::string activity_ = "waiting for images";
  std::vector<std::string> messages_;
};

CalibratedRig rig_of(const Configuration& c, const DriveDevices& devices) {
  constexpr std::array kNames{"left", "right", "camera2", "camera3"};
  CalibratedRig rig;
  rig.rig_name = c.rig.name;
  for (std::size_t k = 0; k < devices.cameras().size(); ++k) {
    const CameraSettings& s = c.cameras[k];
    rig.names.push_back(s.name.empty() ? kNames[k] : s.name);
    rig.serials.push_back(devices.cameras()[k]->info().serial);
    rig.sizes.push_back({s.width, s.height});
  }
  rig.names = distinct_names(rig.names);  // the files of --keep-views are called like this
  return rig;
}

}  // namespace

ExitCode calibrate_live(const CalibrateRequest& request, const Configuration& configuration) {
  const SignalGuard signals;
  if (request.keep_views) make_empty_folder(*request.keep_views);
  const Configuration c = capture_configuration(configuration);
  DriveDevices devices(c, {}, false, std::nullopt);
  Progress progress = Progress::on_stderr(request.quiet);
  for (const std::string& message : devices.remarks()) progress.print("vergence: " + message);
  const CalibratedRig rig = rig_of(c, devices);
  Acquisition::Options options = devices.acquisition_options();
  options.tie_host = monotonic_now();
  Acquisition source(devices.cameras(), devices.ins(), devices.trigger(), options);
  Collection collection(request, rig, nominal_rig(c).intrinsics[0].fx, &source);
  start_acquisition(&source);
  collection.run(signals, &progress);
  source.join();
  progress.finish();
  const auto stopped = signals.stop_code();
  for (const int camera : source.missing())
    progress.print(
        fmt::format("vergence: camera {} did not come back; check its cable and power", camera));
  if (collection.views().size() < kMinViews) {
    progress.print(fmt::format(
        "vergence: no calibration: {} views of the board were taken, {} are the least; is it {}, "
        "whole and lit in every image?",
        collection.views().size(), kMinViews, request.board.describe()));
    return stopped.value_or(source.missing().empty() ? ExitCode::not_usable
                                                     : ExitCode::device_failed);
  }
  const ExitCode code = conclude_calibration(request, rig, collection.views(), &progress);
  if (!source.missing().empty() && !stopped) return ExitCode::device_failed;
  return stopped.value_or(code);
}

}  // namespace vergence::app
