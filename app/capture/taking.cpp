#include "app/capture/taking.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

/// Ends the stream when nothing has come for too long, or a signal has.
class Watchdog {
 public:
  Watchdog(Acquisition* source, Duration limit, const SignalGuard& signals)
      : source_(source),
        limit_(limit.ns()),
        signals_(signals),
        until_(std::chrono::steady_clock::now() + limit_),
        thread_([this] { watch(); }) {}
  ~Watchdog() {
    {
      const std::lock_guard lock(mutex_);
      quit_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  void feed() {
    const std::lock_guard lock(mutex_);
    until_ = std::chrono::steady_clock::now() + limit_;
  }

 private:
  void watch() {
    constexpr auto kLook = std::chrono::milliseconds(50);
    std::unique_lock lock(mutex_);
    while (!quit_ && !signals_.stop_requested() && std::chrono::steady_clock::now() < until_)
      changed_.wait_for(lock, kLook);
    source_->stop();
  }

  Acquisition* source_;
  std::chrono::nanoseconds limit_;
  const SignalGuard& signals_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool quit_ = false;
  std::chrono::steady_clock::time_point until_;
  std::thread thread_;
};

void note(const DeviceEvent& event, Taking* taking) {
  const auto k = static_cast<std::size_t>(event.camera);
  if (event.kind == DeviceEvent::Kind::camera_gone) taking->gone[k] = true;
  if (event.kind == DeviceEvent::Kind::camera_back) taking->gone[k] = false;
}

}  // namespace

Taking take_sets(DriveDevices& devices, const TakingOptions& options, const SignalGuard& signals,
                 const std::function<void(const TakenSet&)>& use) {
  const std::size_t n = devices.cameras().size();
  Taking taking;
  taking.delivered.assign(n, 0);
  taking.gone.assign(n, false);
  Acquisition::Options o = devices.acquisition_options();
  const HostMoment now = moment_now();
  o.tie_stamp = now.day;
  o.tie_host = devices.mock() != nullptr ? devices.start() : now.host;
  Acquisition source(devices.cameras(), devices.ins(), devices.trigger(), o);
  start_acquisition(&source);
  {
    Watchdog watchdog(&source, options.limit, signals);
    int passed = 0;
    for (Acquired item; taking.sets < options.count && source.next(&item);) {
      if (const auto* event = std::get_if<DeviceEvent>(&item)) note(*event, &taking);
      const auto* frame = std::get_if<AcquiredFrame>(&item);
      if (frame == nullptr) continue;
      for (std::size_t i = 0; i < n; ++i) taking.delivered[i] += frame->set.present[i] ? 1 : 0;
      if (frame->set.complete && passed++ >= options.skip) {
        const RigFrame& rig = frame->rig;
        use({taking.sets,
             rig.stamp,
             rig.stamp_error,
             rig.spread,
             frame->set.proof,
             {rig.images.begin(), rig.images.begin() + static_cast<std::ptrdiff_t>(n)}});
        ++taking.sets;
        watchdog.feed();
      }
      source.release(*frame);
    }
  }
  source.stop();
  for (Acquired item; source.next(&item);)
    if (const auto* frame = std::get_if<AcquiredFrame>(&item)) source.release(*frame);
  source.join();
  taking.end = taking.sets == options.count ? Taking::End::done
               : signals.stop_requested()   ? Taking::End::interrupted
                                            : Taking::End::timeout;
  return taking;
}

}  // namespace vergence::app
