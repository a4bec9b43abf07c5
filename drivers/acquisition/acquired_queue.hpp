#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/memory/ring.hpp"
#include "core/types/calibration.hpp"
#include "core/types/time.hpp"
#include "drivers/acquisition/acquired.hpp"
#include "drivers/camera.hpp"
#include "drivers/common/wake_event.hpp"
#include "drivers/sync/open_sets.hpp"

namespace vergence {

/// Output queue of an acquisition, in order, on its way to the consumer's thread.
///
/// Ownership  Cameras outlive it. Slots that the consumer is not given (of frames that were
///            refused, of sets that a newer one overtook) go back to their cameras on the
///            consumer's thread, as those do that it was given and releases.
/// Threads    push(), finish(): one producer. next(), release(): one consumer, which may be sealed.
///            stop(), the figures: any.
/// Full       `wait_when_full`: the producer waits. Else the consumer skips to the newest images,
///            readings that find the queue full are dropped, all else waits.
/// Memory     In place. Errors: none; what was left out is counted.
class AcquiredQueue {
 public:
  /// Slots of a frame that was refused.
  struct Refused {
    SyncedSet set{};
  };
  using Item = std::variant<AcquiredFrame, InsRecord, DeviceEvent, Refused>;

  /// `cameras`: in the order of the rig; the vector outlives it.
  AcquiredQueue(const std::vector<CameraDevice*>& cameras, bool wait_when_full) noexcept
      : cameras_(cameras), wait_when_full_(wait_when_full) {}

  void push(const Item& item) noexcept;
  /// Nothing more will be pushed: next() gives what is there, then false.
  void finish() noexcept;
  /// Nobody may be taking any more: push() does not wait from now on. finish() is still owed.
  void stop() noexcept;

  /// The oldest item, waiting for it; images are views of their slots. False: finished.
  [[nodiscard]] bool next(Acquired* item) noexcept;
  /// Call once for every set that next() returned.
  void release(const SyncedSet& set) noexcept;

  /// Sets that the consumer was not given because it was late.
  [[nodiscard]] std::uint64_t skipped_sets() const noexcept { return skipped_sets_.load(); }
  [[nodiscard]] std::uint64_t dropped_readings() const noexcept { return dropped_readings_.load(); }
  /// Items that waited at once at most.
  [[nodiscard]] std::size_t high_water() const noexcept { return high_water_.load(); }

 private:
  static constexpr std::size_t kItems = 256;
  // Live: sets that may wait for the estimator before the oldest is skipped; when an image was lost
  // so many come at once.
  static constexpr int kMaxWaiting = static_cast<int>(OpenSets::kOpen);

  const std::vector<CameraDevice*>& cameras_;
  bool wait_when_full_;
  Ring<Item, kItems> ring_;
  std::atomic<int> waiting_{0};  // sets in the ring
  WakeEvent filled_, freed_;
  std::atomic<bool> stopped_{false}, finished_{false};
  std::atomic<std::uint64_t> skipped_sets_{0}, dropped_readings_{0};
  std::atomic<std::size_t> high_water_{0};
};

/// Tracks whether the frame-to-pulse association of each camera is verified, and reports changes.
///
/// A camera begins as verified, so that where nothing can be verified nothing is told; and as one
/// of which no frame has come, so that a camera that is not yet there is not told of either.
///
/// Threads  One. Memory: in place. Time: constant a call. Errors: none.
class PairingTracker {
 public:
  struct Change {
    bool verified = false;
    double seconds = 0;  // verified: since the change before it
  };

  /// A frame of that camera has come.
  void frame(std::size_t camera) noexcept { cameras_[camera].any = true; }
  /// It was started again.
  void restarted(std::size_t camera) noexcept { cameras_[camera] = {}; }
  /// Updates with the synchroniser's state. Nullopt: as before, or no frame has come yet.
  [[nodiscard]] std::optional<Change> update(std::size_t camera, bool verified,
                                             HostStamp now) noexcept {
    Camera& own = cameras_[camera];
    if (verified == own.verified || !own.any) return std::nullopt;
    const double seconds = verified ? (now - own.since).to_seconds() : 0;
    own = {true, verified, now};
    return Change{verified, seconds};
  }

 private:
  struct Camera {
    bool any = false;
    bool verified = true;
    HostStamp since{};  // of the last change
  };

  std::array<Camera, kMaxCameras> cameras_{};
};

}  // namespace vergence
