#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "app/session/records.hpp"
#include "core/memory/ring.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// What became of a calibration that was to be kept: a line of events.jsonl, an error of the
/// session as well when it failed.
struct Kept {
  bool failed = false;
  std::string sentence{};  // empty: nothing to tell
};

/// Keeps a calibration. `found`: by the drive; else it is the one that the drive began with and has
/// confirmed.
using KeepCalibration = std::function<Kept(const RigCalibration& rig, bool found)>;

/// Keeps calibrations for the next drive, on a thread of its own (`vergence-keep`): making YAML
/// takes heap memory, and its files wait for the disk, which the recorder's thread does not.
///
/// Threads  One, the recorder's; stop() after the last to be kept.
/// Memory   Fixed for the recorder's thread; what `keep` takes is its thread's.
/// Full     While kMostWaiting wait for the disk a further one is refused.
class CalibrationKeeper {
 public:
  static constexpr std::size_t kMostWaiting = 4;  // they come seconds apart

  /// What became of a calibration.
  struct Outcome {
    EventRecord event{};  // `calibration_kept` or `calibration_not_kept`
    bool failed = false;
  };

  /// `keep` is called on the keeper's thread; *wake is signalled when next() has something.
  CalibrationKeeper(KeepCalibration keep, WakeEvent* wake);
  ~CalibrationKeeper() { stop(); }
  CalibrationKeeper(const CalibrationKeeper&) = delete;
  CalibrationKeeper& operator=(const CalibrationKeeper&) = delete;

  /// What the drive begins with. It is kept when it is confirmed before another one is found.
  void begin_with(const RigCalibration& rig) noexcept { unconfirmed_ = rig; }
  /// The drive has confirmed what is in use. False: too many wait; it is not kept.
  [[nodiscard]] bool confirmed(Stamp stamp) noexcept;
  /// The drive has found one. False: too many wait; it is not kept.
  [[nodiscard]] bool found(Stamp stamp, const RigCalibration& rig) noexcept;
  /// The oldest outcome that nobody has taken yet. False: there is none.
  [[nodiscard]] bool next(Outcome* outcome) noexcept { return outcomes_.pop(outcome); }
  /// Keeps what is waiting and ends the thread. Twice is harmless.
  void stop() noexcept;

 private:
  struct Waiting {
    Stamp stamp{};
    RigCalibration rig{};
    bool found = true;
  };

  [[nodiscard]] bool post(const Waiting& waiting) noexcept;
  void work();
  void keep(const Waiting& waiting);

  KeepCalibration keep_;
  WakeEvent* wake_;
  std::optional<RigCalibration>
      unconfirmed_{};  // the poster's; empty: kept, or not in use any more
  Ring<Waiting, kMostWaiting> waiting_;
  Ring<Outcome, 2 * kMostWaiting>
      outcomes_;  // full: the recorder hangs, its events are lost anyway
  WakeEvent filled_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vergence::app
