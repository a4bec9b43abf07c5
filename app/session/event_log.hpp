#pragma once
#include <limits>

#include "app/runtime/progress.hpp"
#include "app/session/session_observer.hpp"
#include "core/memory/ring.hpp"

namespace vergence::app {

/// Collects by-products of each frame: events and calibrations for the session's output, progress
/// and messages for the terminal.
///
/// Threads  collect(), record_…() and log() run on the estimator's thread, which is sealed, show()
///          on the caller's. After the estimator's thread was joined no synchronisation is needed.
/// Memory   Fixed. If a ring is full, the newest report or message is dropped; every message is
///          also in events.jsonl.
class EventLog {
 public:
  /// The output must outlive the last call of collect() or log().
  void open(SessionOutput* output, Stamp first) noexcept;

  /// Call after process() or finish(): forwards its events and calibrations.
  void collect(const Estimator& estimator) noexcept;
  /// Call with the result of process(): logs when work other than the pose is omitted.
  void record_effort(const PoseSample& sample) noexcept;
  /// Call with each complete report: updates the progress.
  void collect(const FrameReport& report) noexcept { (void)reports_.push(report); }
  /// Logs an event of the session. `kind` points to a constant. `to_user` also prints it on stderr.
  void log(const EventRecord& event, bool to_user = true) noexcept;

  /// Number of points and observations beyond the estimator's capacity.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  /// Prints the waiting messages and updates the progress line. `frames` is the total number; 0 if
  /// unknown.
  void show(Progress* progress, std::uint64_t frames);

 private:
  SessionOutput* output_ = nullptr;
  Stamp first_{};
  std::uint64_t dropped_ = 0;
  // Number of frames since one exceeded its time.
  int whole_frames_ = std::numeric_limits<int>::max() / 2;
  Ring<FrameReport, 64> reports_;
  Ring<EventRecord, 32> notices_;
};

}  // namespace vergence::app
