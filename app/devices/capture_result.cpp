#include "app/devices/capture_result.hpp"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "app/runtime/nearest.hpp"
#include "drivers/clock.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence::app {

namespace {

// Limits in grey levels.
constexpr int kSaturated = 254, kDark = 4;
// Fractions of an image. kMuch leaves nothing visible, and kSome may be a saturated sky.
constexpr double kMuch = 0.5, kSome = 0.05;
// Limits of the mean in grey levels.
constexpr double kBlack = 6, kDim = 30;
// Minimum contrast in grey levels. A smaller one is noise.
constexpr double kFlat = 1.5;
// Minimum sharpness relative to the sharpest camera.
constexpr double kBlurred = 0.2;

std::optional<std::string> why_unusable(const ImageStatistics& f, const std::string& who) {
  if (f.mean < kBlack) return who + " is black; check the lens cap, the light and exposure_us";
  if (f.saturated > kMuch)
    return fmt::format(
        "{} is overexposed: {:.0f} % of it is white; lower exposure_us, then gain_db", who,
        100 * f.saturated);
  if (f.contrast < kFlat)
    return who +
           " is one uniform grey; check for a lens cap, fog on the glass, or a missing sensor "
           "signal";
  return std::nullopt;
}

void on_event(const DeviceEvent& event, CaptureResult* capture) {
  const auto k = static_cast<std::size_t>(event.camera);
  if (event.kind == DeviceEvent::Kind::camera_disconnected) capture->disconnected[k] = true;
  if (event.kind == DeviceEvent::Kind::camera_reconnected) capture->disconnected[k] = false;
}

}  // namespace

ImageStatistics image_statistics(const ImageView& image) noexcept {
  ImageStatistics f;
  double sum = 0, squares = 0, gradients = 0;
  std::int64_t bright = 0, dark = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      const int v = row[x];
      sum += v;
      squares += v * v;
      bright += v >= kSaturated ? 1 : 0;
      dark += v <= kDark ? 1 : 0;
      if (x == 0 || y == 0 || x + 1 == image.width || y + 1 == image.height) continue;
      const int dx = row[x + 1] - row[x - 1], dy = image.at(x, y + 1) - image.at(x, y - 1);
      gradients += dx * dx + dy * dy;
    }
  }
  const double n = static_cast<double>(image.width) * image.height;
  const double inner = static_cast<double>(image.width - 2) * (image.height - 2);
  f.mean = sum / n;
  f.contrast = std::sqrt(std::max(0.0, squares / n - f.mean * f.mean));
  f.saturated = static_cast<double>(bright) / n;
  f.dark = static_cast<double>(dark) / n;
  if (image.width > 2 && image.height > 2) f.sharpness = gradients / 4 / inner;
  return f;
}

std::vector<ImageIssue> evaluate_images(std::span<const std::string> names,
                                        std::span<const ImageStatistics> statistics) {
  std::vector<ImageIssue> remarks;
  const auto add = [&](bool unusable, std::string message) {
    remarks.push_back({unusable, std::move(message)});
  };
  double sharpest = 0;
  std::size_t sharpest_at = 0;
  for (std::size_t k = 0; k < statistics.size(); ++k)
    if (statistics[k].sharpness > sharpest) sharpest = statistics[k].sharpness, sharpest_at = k;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    const ImageStatistics& f = statistics[k];
    const std::string& who = names[k];
    if (const auto reason = why_unusable(f, who)) {
      add(true, *reason);
      continue;
    }
    if (f.saturated > kSome)
      add(false, fmt::format("{} is partly overexposed: {:.0f} % of it is white, where "
                             "nothing can be tracked; a shorter exposure_us may help",
                             who, 100 * f.saturated));
    if (f.mean < kDim)
      add(false, fmt::format("{} is underexposed (mean {:.0f} of 255); raise exposure_us up "
                             "to what motion allows, then gain_db",
                             who, f.mean));
    if (k != sharpest_at && f.sharpness < kBlurred * sharpest)
      add(false, fmt::format("{} is much less sharp than {} ({:.0f} against "
                             "{:.0f}); check focus, dirt and near obstacles",
                             who, names[sharpest_at], f.sharpness, sharpest));
  }
  return remarks;
}

bool are_identical(const ImageView& a, const ImageView& b) noexcept {
  if (a.empty() || b.empty() || a.width != b.width || a.height != b.height) return false;
  for (int y = 0; y < a.height; ++y)
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
  return image_statistics(a).contrast >= kFlat;
}

Configuration capture_configuration(const Configuration& configuration) {
  Configuration c = configuration;
  if (c.sync.mode != SyncMode::ins_syncout) c.ins.driver = "none";
  return c;
}

std::vector<std::string> camera_names(const Configuration& c, int cameras) {
  std::vector<std::string> names;
  for (int k = 0; k < cameras; ++k) {
    std::string name = c.cameras[static_cast<std::size_t>(k)].name;
    std::ranges::replace_if(
        name, [](unsigned char ch) { return std::isalnum(ch) == 0 && ch != '_' && ch != '-'; },
        '_');
    names.push_back(name.empty() ? "camera" + std::to_string(k) : name);
  }
  return distinct_names(names);
}

CaptureResult capture_sets(DriveDevices& devices, const CaptureOptions& options,
                           const SignalGuard& signals,
                           const std::function<void(const CapturedSet&)>& use) {
  const std::size_t n = devices.cameras().size();
  CaptureResult capture;
  capture.delivered.assign(n, 0);
  capture.disconnected.assign(n, false);
  Acquisition::Options o = devices.acquisition_options();
  const HostMoment now = moment_now();
  o.tie_stamp = now.day;
  o.tie_host = devices.mock() != nullptr ? devices.start() : now.host;
  Acquisition source(devices.cameras(), devices.ins(), devices.trigger(), o);
  start_acquisition(&source);
  {
    using Clock = std::chrono::steady_clock;
    const auto limit = std::chrono::nanoseconds(options.limit.ns());
    std::atomic<Clock::time_point> until{Clock::now() + limit};
    // Ends the stream when nothing has come for too long, or a signal has.
    const std::jthread watchdog([&](const std::stop_token& done) {
      constexpr auto kPollInterval = std::chrono::milliseconds(50);
      while (!done.stop_requested() && !signals.stop_requested() && Clock::now() < until.load())
        std::this_thread::sleep_for(kPollInterval);
      source.stop();
    });
    int passed = 0;
    for (Acquired item; capture.sets < options.count && source.next(&item);) {
      if (const auto* event = std::get_if<DeviceEvent>(&item)) on_event(*event, &capture);
      const auto* frame = std::get_if<AcquiredFrame>(&item);
      if (frame == nullptr) continue;
      for (std::size_t i = 0; i < n; ++i) capture.delivered[i] += frame->set.present[i] ? 1 : 0;
      if (frame->set.complete && passed++ >= options.skip) {
        const RigFrame& rig = frame->rig;
        use({capture.sets,
             rig.stamp,
             rig.stamp_error,
             rig.spread,
             frame->set.proof,
             {rig.images.begin(), rig.images.begin() + static_cast<std::ptrdiff_t>(n)}});
        ++capture.sets;
        until = Clock::now() + limit;
      }
      source.release(*frame);
    }
  }
  source.stop();
  for (Acquired item; source.next(&item);)
    if (const auto* frame = std::get_if<AcquiredFrame>(&item)) source.release(*frame);
  source.join();
  capture.end = capture.sets == options.count ? CaptureResult::End::done
                : signals.stop_requested()    ? CaptureResult::End::interrupted
                                              : CaptureResult::End::timeout;
  return capture;
}

}  // namespace vergence::app
