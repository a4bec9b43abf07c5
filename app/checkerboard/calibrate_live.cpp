
#include <array>
#include <chrono>
#include <thread>

#include <fmt/format.h>

#include "app/checkerboard/board_detector.hpp"
#include "app/checkerboard/calibrate_session.hpp"
#include "app/checkerboard/coverage.hpp"
#include "app/datasets/image_writer.hpp"
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
  constexpr std::array kPhrases{"taken", "target not seen by all cameras", "hold it still",
                                "already covered"};
  return kPhrases.at(static_cast<std::size_t>(verdict));
}

/// A folder that is there and has nothing in it yet.
void make_empty_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error) || !fs::is_empty(folder, error))
    throw InputError(folder.string() +
                     ": is not empty or cannot be created; --keep-views needs a new or empty "
                     "directory");
}

/// Takes views of the target from the cameras' images.
///
/// Threads  One; another one stops the source when a signal comes.
class Collection {
 public:
  Collection(const CalibrateRequest& request, const std::vector<std::string>& names,
             ViewCollector collector, Acquisition* source, Progress* progress)
      : request_(request),
        names_(names),
        source_(source),
        progress_(progress),
        collector_(std::move(collector)) {}

  /// Until the source ends, nothing is missing, or a signal comes.
  void run(const SignalGuard& signals) {
    const std::jthread stopper([this, &signals](const std::stop_token& ended) {
      while (!ended.stop_requested() && !signals.stop_requested())
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      source_->stop();
    });
    for (Acquired item; source_->next(&item);) {
      if (const auto* event = std::get_if<DeviceEvent>(&item)) report(*event);
      const auto* frame = std::get_if<AcquiredFrame>(&item);
      if (frame == nullptr) continue;
      if (!collector_.complete()) offer(frame->rig);
      source_->release(*frame);
      if (collector_.complete()) source_->stop();
    }
  }
  [[nodiscard]] const std::vector<BoardView>& views() const noexcept { return collector_.views(); }

 private:
  void report(const DeviceEvent& event) {
    const bool disconnected = event.kind == DeviceEvent::Kind::camera_disconnected;
    if (disconnected || event.kind == DeviceEvent::Kind::camera_reconnected)
      progress_->print(fmt::format(
          "vergence: camera {} {}", event.camera,
          disconnected ? "is disconnected; check its cable. Waiting for it" : "is reconnected"));
  }

  void offer(const RigFrame& frame) {
    BoardView seen;
    const std::size_t number = collector_.views().size();
    seen.name = fmt::format("view {}", number);
    for (std::size_t k = 0; k < names_.size(); ++k)
      seen.corners[k] = find_board(frame.images[k], request_.calibration.board, BoardSearch::quick,
                                   seen.corners[0]);
    const OfferResult result = collector_.offer(seen);
    if (result == OfferResult::accepted && request_.keep_views) keep(frame, number);
    const auto needs = collector_.coverage().needs();
    state_.state = "calibrate";
    ++state_.frame;
    state_.activity =
        fmt::format("{} views · {}{}", collector_.views().size(), phrase(result),
                    needs.empty() ? "" : fmt::format(" · missing: {}", fmt::join(needs, "; ")));
    progress_->update(state_);
  }

  void keep(const RigFrame& frame, std::size_t number) {
    for (std::size_t k = 0; k < names_.size(); ++k) {
      if (frame.images[k].empty()) continue;
      try {
        write_png(*request_.keep_views / fmt::format("{}_{:03}.png", names_[k], number),
                  frame.images[k]);
      } catch (const InputError& e) {
        progress_->print(fmt::format("vergence: {}; the view is used nevertheless", e.what()));
      }
    }
  }

  const CalibrateRequest& request_;
  const std::vector<std::string>& names_;
  Acquisition* source_;
  Progress* progress_;
  ProgressState state_{};
  ViewCollector collector_;
};

}  // namespace

ExitCode calibrate_live(const CalibrateRequest& request, const Configuration& configuration) {
  const SignalGuard signals;
  if (request.keep_views) make_empty_folder(*request.keep_views);
  const Configuration c = capture_configuration(configuration);
  DriveDevices devices(c, {}, false, std::nullopt);
  Progress progress = Progress::on_stderr(request.quiet);
  for (const std::string& message : devices.remarks()) progress.print("vergence: " + message);
  CalibrationFile file;
  file.rig_name = c.rig.name;
  std::vector<ImageSize> sizes;
  for (std::size_t k = 0; k < devices.cameras().size(); ++k) {
    const CameraSettings& camera = c.cameras[k];
    if (!camera.name.empty()) file.names[k] = camera.name;
    file.serials[k] = devices.cameras()[k]->info().serial;
    sizes.push_back({camera.width, camera.height});
  }
  // The files of --keep-views are named after the cameras.
  const std::vector<std::string> names =
      distinct_names({file.names.begin(), file.names.begin() + std::ssize(sizes)});
  std::ranges::copy(names, file.names.begin());
  const BoardPattern& board = request.calibration.board;
  Coverage coverage(board, names, sizes, nominal_rig(c).intrinsics[0].fx);
  Acquisition::Options options = devices.acquisition_options();
  options.tie_host = monotonic_now();
  Acquisition source(devices.cameras(), devices.ins(), devices.trigger(), options);
  Collection collection(request, names, ViewCollector(std::move(coverage), sizes[0].width), &source,
                        &progress);
  start_acquisition(&source);
  collection.run(signals);
  source.join();
  progress.finish();
  const auto stopped = signals.stop_code();
  for (const int camera : source.missing())
    progress.print(
        fmt::format("vergence: camera {} did not reconnect; check its cable and power", camera));
  if (collection.views().size() < kMinViews) {
    progress.print(
        fmt::format("vergence: no calibration: {} views of the target were taken, at least {} are "
                    "needed; check that it is {}, complete and well lit in every image",
                    collection.views().size(), kMinViews, board.describe()));
    return stopped.value_or(source.missing().empty() ? ExitCode::not_usable
                                                     : ExitCode::device_failed);
  }
  const ExitCode code =
      conclude_calibration(request, sizes, std::move(file), collection.views(), &progress);
  if (!source.missing().empty() && !stopped) return ExitCode::device_failed;
  return stopped.value_or(code);
}

}  // namespace vergence::app
