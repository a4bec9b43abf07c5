#include "app/session/recorder.hpp"

#include <cerrno>
#include <cstring>
#include <new>
#include <system_error>

#include "app/datasets/trajectory_files.hpp"
#include "app/runtime/errors.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {

struct Recorder::Files {
  Files(const std::filesystem::path& session, const Options& options)
      : trajectory(session / "trajectory.tum"),
        reference(session / "reference.tum"),
        poses(session / "poses.csv"),
        events(session / "events.jsonl"),
        all{&trajectory, &reference, &poses, &events} {
    // Buffer in bytes for minutes of INS samples.
    constexpr std::size_t kMinutes = std::size_t{16} << 20;
    if (options.ins) all.push_back(&ins.emplace(session / "ins.csv", kMinutes));
  }
  /// The first line of a table; empty: the file has none.
  [[nodiscard]] std::string head(const LineFile* file) const {
    if (file == &poses) return std::string(kPosesHeader) + "\n";
    return ins && file == &*ins ? std::string(kInsHeader) + "\n" : "";
  }
  LineFile trajectory, reference, poses, events;
  std::optional<LineFile> ins{};
  // True if a line was written to `reference`.
  bool has_reference = false;
  std::vector<LineFile*> all;
};

Recorder::Recorder(const std::filesystem::path& folder, const Options& options)
    : options_(options),
      files_(std::make_unique<Files>(folder, options)),
      newest_(options.first),
      thread_(options.when_full) {
  // Bytes of a line in which every character of an event's message is escaped as \uXXXX.
  constexpr std::size_t kLongestLine = 2048;
  line_.reserve(kLongestLine);
  for (LineFile* file : files_->all) {
    memory_ += file->pending();
    file->append(files_->head(file));
  }
  thread_.start(
      "vergence-record", [this] { begin(); }, [this](const Record* record) { process(record); });
}

Recorder::~Recorder() { thread_.stop(); }

void Recorder::begin() {
  // Writes the headers of the tables.
  flush();
  flushed_ = written_back_ = std::chrono::steady_clock::now();
  AllocationGuard::seal_thread();
}

/// Null: nothing waits, so that lines go to the files at once; else once a second.
void Recorder::process(const Record* record) {
  constexpr std::chrono::seconds kFlushInterval{1}, kWriteBack{2};
  if (record != nullptr) std::visit([this](const auto& r) { write(r); }, *record);
  const auto now = std::chrono::steady_clock::now();
  if (record != nullptr && now - flushed_ < kFlushInterval) return;
  flush();
  flushed_ = now;
  if (now - written_back_ < kWriteBack) return;
  for (LineFile* file : files_->all) file->write_back();
  written_back_ = now;
}

void Recorder::write(const InsRecord& reading) {
  format_ins_record(reading, &line_);
  files_->ins->append(line_);
}

void Recorder::write(const EventRecord& e) {
  totals_->add(e);
  format_event(e, &line_);
  files_->events.append(line_);
}

void Recorder::write(const FrameReport& r) {
  const Stamp stamp = newest_ = r.pose.stamp;
  if (options_.disk_full) pretend(stamp);
  format_pose_row(r, &line_);
  files_->poses.append(line_);
  totals_->add(r);
  if (r.pose.status == PoseStatus::lost) return;
  format_tum(stamp, r.pose.T_world_left, &line_);
  files_->trajectory.append(line_);
  if (!r.T_reference_left) return;
  format_tum(stamp, *r.T_reference_left, &line_);
  files_->reference.append(line_);
  files_->has_reference = true;
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
  // Lines from before the simulated full disk are still written.
  if (full) flush();
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
  if (!disk_full_)
    return write(EventRecord(newest_, "disk_recovered", "lines are written again; {} were lost",
                             lost_lines()));
  // strerror() may allocate.
  const char* words = ::strerrordesc_np(fault);
  if (words == nullptr) words = "unknown error";
  ErrorMessage message{};
  (void)fmt::format_to_n(message.begin(), message.size() - 1,
                         "{}: cannot be written ({}); the session continues and writing is retried "
                         "every {} s; check the disk",
                         failed->path().native(), words, kRetry.count());
  (void)error_messages_.push(message);
  write(EventRecord(newest_, "disk_full", "the session's files cannot be written ({})", words));
}

std::uint64_t Recorder::lost_lines() const {
  std::uint64_t lines = 0;
  for (const LineFile* file : files_->all) lines += file->lost_lines();
  return lines;
}

std::vector<std::string> Recorder::pop_errors() {
  std::vector<std::string> messages;
  for (ErrorMessage c; error_messages_.pop(&c);) messages.emplace_back(c.data());
  messages.insert(messages.end(), errors_.begin(), errors_.end());
  errors_.clear();
  return messages;
}

/// The trajectories, from the session's own files: nothing that grows with the drive waits in
/// memory.
void Recorder::read_back() {
  SessionTotals& totals = *totals_;
  const auto read = [this](const LineFile& file, std::vector<StampedPose>* out) {
    try {
      *out = read_tum(file.path());
    } catch (const InputError& e) {
      errors_.push_back(std::string(e.what()) + "; summary.json lacks the metrics of this file");
    } catch (const std::bad_alloc&) {
      errors_.push_back(
          file.path().string() +
          ": is too long for this machine's memory; summary.json lacks the metrics of this file");
    }
  };
  if (totals.ok + totals.degraded > 0) read(files_->trajectory, &totals.trajectory);
  if (files_->has_reference) read(files_->reference, &totals.reference);
}

std::unique_ptr<SessionTotals> Recorder::close() {
  thread_.stop();
  SessionTotals& totals = *totals_;
  for (LineFile* file : files_->all) {
    file->close(&totals.faults);
    totals.lost_lines += file->lost_lines();
  }
  // A file that says nothing would look like a reference that was lost.
  std::error_code ignored;
  if (!files_->has_reference) std::filesystem::remove(files_->reference.path(), ignored);
  if (options_.keep_trajectory) read_back();
  totals.dropped_records = dropped_records_;
  totals.dropped_readings = dropped_readings_;
  totals.ring_high_water = thread_.high_water();
  return std::move(totals_);
}

}  // namespace vergence::app
