#pragma once
#include <cstdint>
#include <limits>
#include <string_view>

#include "app/runtime/progress.hpp"
#include "app/session/session_observer.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/ring.hpp"

namespace vergence::app {

/// Collects by-products of each frame: events and calibrations for the
/// recorder, the state of things for the progress line, messages for the user.
///
/// Threads  note…(), log(): the estimator's, sealed. show(): the caller's. After the estimator's
///          thread has joined all is anyone's.
/// Memory   Fixed. Full: of the states for the
///          line the newest are lost, the next one tells the same and more; of the messages too,
///          and events.jsonl has them.
class EventLog {
 public:
  /// The output outlives the last note.
  void open(SessionOutput* output, Stamp first) noexcept;

  /// After a process() or finish() call: its events and its calibrations.
  void note(const Estimator& estimator) noexcept;
  /// The sample of a process() call.
  void note(const PoseSample& sample) noexcept;
  /// A frame that was not read.
  void record_skipped() noexcept;
  void record_distance_from_ins(double metres) noexcept { now_.from_ins_m = metres; }
  /// An event of the session's own. `kind` points to a constant. `to_user`: on stderr, too.
  void log(Stamp stamp, const char* kind, std::string_view message, bool to_user) noexcept;
  void log(const EventRecord& event, bool to_user) noexcept;

  /// Points and observations over the estimator's capacity.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  /// Says what there is to say and updates the line. `frames` of the whole drive; 0: nobody knows.
  void show(Progress* progress, std::uint64_t frames);

 private:
  struct ProgressSnapshot {
    std::uint64_t done = 0;  // frames, skipped ones included
    State state = State::initialising;
    Reason reason = Reason::none;
    double path_m = 0;
    int inliers = 0;
    float estimate_ms = 0;
    double from_ins_m = -1;  // negative: not compared
  };

  void record_effort(const PoseSample& sample) noexcept;

  SessionOutput* output_ = nullptr;
  Stamp first_{};
  ProgressSnapshot now_{};
  std::uint64_t dropped_ = 0;
  Vec3 last_position_ = Vec3::Zero();
  bool posed_ = false;
  int whole_frames_ = std::numeric_limits<int>::max() / 2;  // since one had no time for its work
  Ring<ProgressSnapshot, 64> progress_snapshots_;
  Ring<EventRecord, 32> notices_;
};

}  // namespace vergence::app
