#include "app/session/recorder.hpp"

#include <pthread.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "app/datasets/trajectory_files.hpp"
#include "app/runtime/errors.hpp"
#include "app/session/records.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {

CalibrationStateWriter::CalibrationStateWriter(KeepCalibration keep, WakeEvent* wake)
    : keep_(std::move(keep)), wake_(wake), thread_([this] { work(); }) {}

bool CalibrationStateWriter::confirmed(Stamp stamp) noexcept {
  if (!unconfirmed_) return true;
  const Waiting begun_with{stamp, *unconfirmed_, false};
  unconfirmed_.reset();
  return post(begun_with);
}

bool CalibrationStateWriter::found(Stamp stamp, const RigCalibration& rig) noexcept {
  unconfirmed_.reset();
  return post({stamp, rig, true});
}

bool CalibrationStateWriter::post(const Waiting& waiting) noexcept {
  if (!waiting_.push(waiting)) return false;
  filled_.signal();
  return true;
}

void CalibrationStateWriter::stop() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true, std::memory_order_release);
  filled_.signal();
  thread_.join();
}

void CalibrationStateWriter::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-state");
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

void CalibrationStateWriter::keep(const Waiting& waiting) {
  const Kept kept = keep_(waiting.rig, waiting.found);
  if (kept.message.empty()) return;
  Outcome outcome;
  outcome.failed = kept.failed;
  outcome.event.stamp = waiting.stamp;
  outcome.event.kind = kept.failed ? "calibration_save_failed" : "calibration_saved";
  outcome.event.set_message(kept.message);
  (void)outcomes_.push(outcome);
  wake_->signal();
}

struct Recorder::Files {
  Files(const std::filesystem::path& session, const Options& options)
      : trajectory(session / "trajectory.tum"),
        reference(session / "reference.tum"),
        poses(session / "poses.csv"),
        calibrations(session / "calibrations.csv"),
        events(session / "events.jsonl"),
        all{&trajectory, &reference, &poses, &calibrations, &events} {
    constexpr std::size_t kMinutes = std::size_t{16} << 20;  // bytes: readings are many
    if (options.ins) all.push_back(&ins.emplace(session / "ins.csv", kMinutes));
  }
  /// The first line of a table; empty: the file has none.
  [[nodiscard]] std::string head(const LineFile* file) const {
    if (file == &poses) return std::string(kPosesHeader) + "\n";
    if (file == &calibrations) return std::string(kCalibrationsHeader) + "\n";
    return ins && file == &*ins ? std::string(kInsHeader) + "\n" : "";
  }
  LineFile trajectory, reference, poses, calibrations, events;
  std::optional<LineFile> ins{};
  bool has_reference = false;  // a line was written there
  std::vector<LineFile*> all;
};

namespace {

constexpr std::string_view kVerified = "calibration_verified";  // an event's kind
constexpr std::size_t kLongestLine = 2048;  // bytes: calibrations.csv has the longest, some 800

}  // namespace

Recorder::Recorder(const std::filesystem::path& folder, const Options& options)
    : options_(options), files_(std::make_unique<Files>(folder, options)), newest_(options.first) {
  line_.reserve(kLongestLine);
  if (options.keep) keeper_ = std::make_unique<CalibrationStateWriter>(options.keep, &filled_);
  memory_ = totals_.memory();
  for (LineFile* file : files_->all) {
    memory_ += file->pending();
    file->append(files_->head(file));
  }
  thread_ = std::thread([this] { work(); });
}

Recorder::~Recorder() { stop_and_join(); }

void Recorder::stop_and_join() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true, std::memory_order_release);
  filled_.signal();
  thread_.join();
}

template <class Value, std::size_t N>
bool Recorder::push(Queue<Value, N>* queue, const Value& value) noexcept {
  for (;;) {
    const WakeEvent::Ticket seen = freed_.ticket();
    if (queue->ring.push(value)) break;
    if (options_.when_full == WhenFull::drop) {
      queue->dropped.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    freed_.wait(seen);
  }
  queue->high_water = std::max(queue->high_water, queue->ring.size());
  filled_.signal();
  return true;
}

void Recorder::post(const Record& record) noexcept {
  if (push(&records_, record)) ++turn_.posted;
}

void Recorder::on_reading(const InsRecord& reading) noexcept { (void)push(&readings_, reading); }

void Recorder::on_calibration(const CalibrationRecord& calibration) noexcept {
  (void)push(&calibrations_, {calibration, turn_.posted});
}

void Recorder::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-record");
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kFlushAtLeast{1}, kWriteBack{2};
  auto flushed = Clock::now(), written_back = flushed;
  const auto hand_over = [&] {
    flush();
    flushed = Clock::now();
    if (flushed - written_back < kWriteBack) return;
    for (LineFile* file : files_->all) file->write_back();
    written_back = flushed;
  };
  flush();  // the heads of the tables
  AllocationGuard::seal_thread();
  for (;;) {
    const WakeEvent::Ticket seen = filled_.ticket();
    const bool stopping = stop_.load(
        std::memory_order_acquire);  // before the ring: what was posted before is still found
    const bool took = take(), decided = take_outcome();
    if (took || decided) {
      if (Clock::now() - flushed < kFlushAtLeast) continue;
    } else if (stopping) {
      break;
    } else {
      hand_over();
      filled_.wait(seen);
      continue;
    }
    hand_over();
  }
}

/// The oldest record and reading, as far as there are any, behind the calibrations whose turn it
/// is. False: there were none.
bool Recorder::take() {
  Record record;
  InsRecord reading;
  const bool one = records_.ring.pop(&record), other = readings_.ring.pop(&reading);
  if (one || other) freed_.signal();
  // After the record: all that were posted before it are found.
  const bool calibrated = take_calibrations();
  if (one) {
    std::visit([this](const auto& r) { write(r); }, record);
    ++turn_.written;
  }
  if (other) write(reading);
  return one || other || calibrated;
}

/// Those that were posted before the next record that is written. False: there are none.
bool Recorder::take_calibrations() {
  for (bool any = false;; any = true) {
    if (!turn_.next) {
      Placed oldest;
      if (!calibrations_.ring.pop(&oldest)) return any;
      freed_.signal();
      turn_.next = oldest;
    }
    if (turn_.next->after > turn_.written) return any;
    write(turn_.next->calibration);
    turn_.next.reset();
  }
}

void Recorder::write(const InsRecord& reading) {
  format_ins_record(reading, &line_);
  files_->ins->append(line_);
}

void Recorder::write(const EventRecord& e) {
  totals_.add(e);
  format_event(e, &line_);
  files_->events.append(line_);
  if (keeper_ != nullptr && std::string_view(e.kind) == kVerified)
    report_kept(keeper_->confirmed(e.stamp));
}

void Recorder::write(const CalibrationRecord& c) {
  for (int k = 1; k < c.calibration.cameras; ++k) {
    format_calibration(c, k, &line_);
    files_->calibrations.append(line_);
  }
  if (!c.decided && keeper_ != nullptr) keeper_->begin_with(c.calibration);
  if (!c.decided || !totals_.add(c) || keeper_ == nullptr) return;
  report_kept(keeper_->found(c.stamp, c.calibration));
}

void Recorder::report_kept(bool kept) noexcept {
  if (!kept) report_error("a calibration is not kept: the disk has not taken those before it");
}

void Recorder::write(const FrameReport& r) {
  const Stamp stamp = newest_ = r.pose.stamp;
  if (options_.disk_full) pretend(stamp);
  format_frame(r, &line_);
  files_->poses.append(line_);
  totals_.add(r);
  if (r.pose.status == PoseStatus::lost) return;
  format_tum(stamp, r.pose.T_world_left, &line_);
  files_->trajectory.append(line_);
  if (!r.T_reference_left) return;
  format_tum(stamp, *r.T_reference_left, &line_);
  files_->reference.append(line_);
  files_->has_reference = true;
}

/// Outcome of a calibration. False: there is nothing new.
bool Recorder::take_outcome() {
  CalibrationStateWriter::Outcome outcome;
  if (keeper_ == nullptr || !keeper_->next(&outcome)) return false;
  write(outcome.event);
  if (outcome.failed) report_error("{}", outcome.event.message.data());
  return true;
}

/// Writes what waits. After a failure no file is written again before kRetry has passed: every
/// attempt may take a stalled disk seconds.
void Recorder::flush() {
  const auto now = std::chrono::steady_clock::now();
  if (disk_full_ && now < retry_due_) return;
  retry_due_ = now + kRetry;
  const LineFile* failed = nullptr;
  for (LineFile* file : files_->all)
    if (!file->flush() && failed == nullptr) failed = file;
  if (failed != nullptr)
    record_disk(failed, failed->fault());
  else if (!pretended_)
    record_disk(nullptr, 0);
}

void Recorder::pretend(Stamp stamp) {
  const bool full = options_.disk_full(stamp);
  if (full == pretended_) return;
  if (full) flush();  // what came before has found room
  pretended_ = full;
  for (LineFile* file : files_->all) file->pretend_full(full);
  retry_due_ = {};
  if (full)
    record_disk(&files_->poses, ENOSPC);
  else
    flush();
}

/// An error and an event when writing begins to fail, an event when all was written again.
/// `failed`: a file that could not be written; null: all were.
void Recorder::record_disk(const LineFile* failed, int fault) {
  if ((failed != nullptr) == disk_full_) return;
  disk_full_ = failed != nullptr;
  EventRecord event;
  event.stamp = newest_;
  event.kind = disk_full_ ? "disk_full" : "disk_recovered";
  std::array<char, 256> text{};
  const auto out = text.begin();
  if (disk_full_) {
    const char* words = ::strerrordesc_np(fault);  // strerror() may take memory
    if (words == nullptr) words = "unknown error";
    report_error(
        "{}: cannot be written ({}); the session goes on and writing is tried again every "
        "{} s: check that disk",
        failed->path().native(), words, kRetry.count());
    (void)fmt::format_to_n(out, text.size() - 1, "the session's files cannot be written ({})",
                           words);
  } else {
    (void)fmt::format_to_n(out, text.size() - 1, "the disk takes lines again; {} were lost",
                           lost_lines());
  }
  event.set_message(text.data());
  write(event);
}

std::uint64_t Recorder::lost_lines() const {
  std::uint64_t lines = 0;
  for (const LineFile* file : files_->all) lines += file->lost_lines();
  return lines;
}

template <class... Arguments>
void Recorder::report_error(const char* format, const Arguments&... arguments) noexcept {
  ErrorMessage message{};
  (void)fmt::format_to_n(message.begin(), message.size() - 1, fmt::runtime(format), arguments...);
  (void)error_messages_.push(message);
}

std::vector<std::string> Recorder::take_errors() {
  std::vector<std::string> messages;
  for (ErrorMessage c; error_messages_.pop(&c);) messages.emplace_back(c.data());
  messages.insert(messages.end(), errors_.begin(), errors_.end());
  errors_.clear();
  return messages;
}

/// The trajectories, from the session's own files: nothing that grows with the drive waits in
/// memory.
void Recorder::read_back() {
  SessionTotals& totals = totals_.totals();
  const auto read = [this](const LineFile& file, std::vector<StampedPose>* out) {
    try {
      *out = read_tum(file.path());
    } catch (const InputError& e) {
      errors_.push_back(std::string(e.what()) + "; the summary lacks what is made from it");
    } catch (const std::bad_alloc&) {
      errors_.push_back(file.path().string() +
                        ": is too long for this machine's memory; the summary lacks what is made "
                        "from it");
    }
  };
  if (totals.ok + totals.degraded > 0) read(files_->trajectory, &totals.trajectory);
  if (files_->has_reference) read(files_->reference, &totals.reference);
}

std::unique_ptr<SessionTotals> Recorder::close() {
  stop_and_join();
  SessionTotals& totals = totals_.totals();
  if (keeper_ != nullptr) keeper_->stop();
  while (take_outcome()) {
  }
  for (LineFile* file : files_->all) {
    const bool good = file->close();
    totals.lost_lines += file->lost_lines();
    if (good && file->lost_lines() == 0) continue;
    const std::string why = good ? std::to_string(file->lost_lines()) + " lines are lost"
                                 : std::strerror(file->fault());
    totals.faults.push_back(file->path().string() + ": is not complete (" + why +
                            "); check that disk and make room on it");
  }
  // A file that says nothing would look like a reference that was lost.
  std::error_code ignored;
  if (!files_->has_reference) std::filesystem::remove(files_->reference.path(), ignored);
  if (options_.keep_trajectory) read_back();
  totals.dropped_records = records_.dropped.load(std::memory_order_relaxed) +
                           calibrations_.dropped.load(std::memory_order_relaxed);
  totals.dropped_readings = readings_.dropped.load(std::memory_order_relaxed);
  totals.ring_high_water = records_.high_water;
  return std::make_unique<SessionTotals>(std::move(totals));
}

}  // namespace vergence::app
