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

/// Ordered output queue of an acquisition, read by the consumer's thread.
///
/// Ownership  The cameras must outlive it. Slots that are not given to the consumer (refused
///            frames, superseded sets) return to their cameras on the consumer's thread, as
///            released ones do.
/// Threads    One producer calls push() and finish(); one consumer, which may be sealed, next() and
///            release(). The other calls are thread-safe.
/// Full       With `wait_when_full` the producer waits. Otherwise the consumer skips to the newest
///            images, INS samples are dropped and counted, and everything else waits.
/// Memory     Fixed.
class AcquiredQueue {
 public:
  /// Slots of a refused frame.
  struct Refused {
    SyncedSet set{};
  };
  using Item = std::variant<AcquiredFrame, InsRecord, DeviceEvent, Refused>;

  /// `cameras` are in the order of the rig; the vector must outlive the queue.
  AcquiredQueue(const std::vector<CameraDevice*>& cameras, bool wait_when_full) noexcept
      : cameras_(cameras), wait_when_full_(wait_when_full) {}

  void push(const Item& item) noexcept;
  /// Ends the input: next() returns the remaining items, then false.
  void finish() noexcept;
  /// Keeps push() from waiting, because the consumer may have stopped. finish() is still required.
  void stop() noexcept;

  /// Waits for the oldest item; images are views of their slots. Returns false once finished.
  [[nodiscard]] bool next(Acquired* item) noexcept;
  /// Call once for every set that next() returned.
  void release(const SyncedSet& set) noexcept;

  /// Number of sets skipped because the consumer was late.
  [[nodiscard]] std::uint64_t skipped_sets() const noexcept { return skipped_sets_.load(); }
  [[nodiscard]] std::uint64_t dropped_readings() const noexcept { return dropped_readings_.load(); }
  /// Maximum number of waiting items.
  [[nodiscard]] std::size_t high_water() const noexcept { return high_water_.load(); }

 private:
  static constexpr std::size_t kItems = 256;
  // Live: sets that may wait for the estimator before the oldest is skipped. After a lost image
  // this many are output together.
  static constexpr int kMaxWaiting = static_cast<int>(OpenSets::kOpen);

  const std::vector<CameraDevice*>& cameras_;
  bool wait_when_full_;
  Ring<Item, kItems> ring_;
  // Number of sets in the ring.
  std::atomic<int> waiting_{0};
  WakeEvent filled_, freed_;
  std::atomic<bool> stopped_{false}, finished_{false};
  std::atomic<std::uint64_t> skipped_sets_{0}, dropped_readings_{0};
  std::atomic<std::size_t> high_water_{0};
};

/// Tracks whether the frame-to-pulse association of each camera is verified, and reports changes.
///
/// A camera starts as verified and without a frame, so modes without verification and absent
/// cameras cause no report. Not thread-safe. Does not allocate. Constant time per call.
class PairingTracker {
 public:
  struct Change {
    bool verified = false;
    /// If verified, the time since the previous change.
    double seconds = 0;
  };

  /// Records a frame of that camera.
  void frame(std::size_t camera) noexcept { cameras_[camera].any = true; }
  /// Records a restart of that camera.
  void restarted(std::size_t camera) noexcept { cameras_[camera] = {}; }
  /// Updates with the synchroniser's state. Returns nullopt without a change or before the first
  /// frame.
  [[nodiscard]] std::optional<Change> update(std::size_t camera, bool verified,
                                             HostStamp now) noexcept {
    Camera& state = cameras_[camera];
    if (verified == state.verified || !state.any) return std::nullopt;
    const double seconds = verified ? (now - state.since).to_seconds() : 0;
    state = {true, verified, now};
    return Change{verified, seconds};
  }

 private:
  struct Camera {
    bool any = false;
    bool verified = true;
    // Time of the last change.
    HostStamp since{};
  };

  std::array<Camera, kMaxCameras> cameras_{};
};

}  // namespace vergence
