#include "app/session/calibration_keeper.hpp"

#include <pthread.h>

#include <utility>

namespace vergence::app {

CalibrationKeeper::CalibrationKeeper(KeepCalibration keep, WakeEvent* wake)
    : keep_(std::move(keep)), wake_(wake), thread_([this] { work(); }) {}

bool CalibrationKeeper::confirmed(Stamp stamp) noexcept {
  if (!unconfirmed_) return true;
  const Waiting begun_with{stamp, *unconfirmed_, false};
  unconfirmed_.reset();
  return post(begun_with);
}

bool CalibrationKeeper::found(Stamp stamp, const RigCalibration& rig) noexcept {
  unconfirmed_.reset();
  return post({stamp, rig, true});
}

bool CalibrationKeeper::post(const Waiting& waiting) noexcept {
  if (!waiting_.push(waiting)) return false;
  filled_.signal();
  return true;
}

void CalibrationKeeper::stop() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true, std::memory_order_release);
  filled_.signal();
  thread_.join();
}

void CalibrationKeeper::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-keep");
  for (Waiting waiting;;) {
    const WakeEvent::Ticket seen = filled_.ticket();
    const bool stopping = stop_.load(std::memory_order_acquire);  // before the ring
    if (waiting_.pop(&waiting))
      keep(waiting);
    else if (stopping)
      return;
    else
      filled_.wait(seen);
  }
}

void CalibrationKeeper::keep(const Waiting& waiting) {
  const Kept kept = keep_(waiting.rig, waiting.found);
  if (kept.sentence.empty()) return;
  Outcome outcome;
  outcome.failed = kept.failed;
  outcome.event.stamp = waiting.stamp;
  outcome.event.kind = kept.failed ? "calibration_not_kept" : "calibration_kept";
  outcome.event.set_sentence(kept.sentence);
  (void)outcomes_.push(outcome);
  wake_->signal();
}

}  // namespace vergence::app
