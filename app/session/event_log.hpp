#pragma once
#include <cstdint>
#include <limits>
#include <string_view>

#include "app/runtime/progress.hpp"
#include "app/session/session_observer.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/ring.hpp"

namespace vergence::app {

/// Collects by-products of each frame: events and calibrations for the session's output, progress
/// and messages for the terminal.
///
/// Threads  collect(), record_…(), log(): the estimator's, sealed. show(): the caller's. No
///          synchronisation is needed after the estimator's thread has been joined.
/// Memory   Fixed. If a ring is full, the newest report or message is dropped; every message also
///          is in events.jsonl.
class EventLog {
 public:
  /// The output outlives the last call of collect() or log().
  void open(SessionOutput* output, Stamp first) noexcept;

  /// Call after process() or finish(): forwards its events and calibrations.
  void collect(const Estimator& estimator) noexcept;
  /// Call with the result of process(): logs when work other than the pose is omitted.
  void record_effort(const PoseSample& sample) noexcept;
  /// Call with each complete report: updates the progress.
  void collect(const FrameReport& report) noexcept { (void)reports_.push(report); }
  /// An event of the session's own. `kind` points to a constant. `to_user`: on stderr, too.
  void log(Stamp stamp, const char* kind, std::string_view message, bool to_user) noexcept;
  void log(const EventRecord& event, bool to_user) noexcept;

  /// Number of points and observations beyond the estimator's capacity.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  /// Prints the waiting messages and updates the progress line. `frames`: of the whole drive; 0 if
  /// unknown.
  void show(Progress* progress, std::uint64_t frames);

 private:
  SessionOutput* output_ = nullptr;
  Stamp first_{};
  std::uint64_t dropped_ = 0;
  int whole_frames_ = std::numeric_limits<int>::max() / 2;  // since one had no time for its work
  Ring<FrameReport, 64> reports_;
  Ring<EventRecord, 32> notices_;
};

}  // namespace vergence::app
