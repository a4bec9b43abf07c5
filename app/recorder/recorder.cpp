#include "app/recorder/recorder.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/recorder/calibration_line.hpp"
#include "app/recorder/event_line.hpp"
#include "app/recorder/line_file.hpp"
#include "app/runtime/errors.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {

static_assert(std::is_trivially_copyable_v<Record> && std::is_trivially_copyable_v<InsRecord>);

struct Recorder::Files {
  Files(const std::filesystem::path& folder, bool with_ins)
      : trajectory(folder / "trajectory.tum"),
        reference(folder / "reference.tum"),
        poses(folder / "poses.csv"),
        calibrations(folder / "calibrations.csv"),
        events(folder / "events.jsonl"),
        all{&trajectory, &reference, &poses, &calibrations, &events} {
    constexpr std::size_t kMinutes = std::size_t{16} << 20;  // bytes: readings are many
    if (with_ins) all.push_back(&ins.emplace(folder / "ins.csv", kMinutes));
    told.resize(all.size());
  }
  /// The first line of a table; empty: the file has none.
  [[nodiscard]] std::string head(const LineFile* file) const {
    if (file == &poses) return std::string(kPosesHeader) + "\n";
    if (file == &calibrations) return std::string(kCalibrationsHeader) + "\n";
    return ins && file == &*ins ? std::string(kInsHeader) + "\n" : "";
  }
  LineFile trajectory, reference, poses, calibrations, events;
  std::optional<LineFile> ins{};
  std::vector<LineFile*> all;
  std::vector<int> told{};  // errno that was complained about, by all
};

namespace {

void append_tum(std::string* line, Stamp stamp, const PoseNumbers& pose) {
  line->clear();
  append_seconds(line, stamp.ns());
  for (const double v : pose.t) fmt::format_to(std::back_inserter(*line), " {:.9f}", v);
  for (const double v : pose.q) fmt::format_to(std::back_inserter(*line), " {:.9f}", v);
  *line += '\n';
}

constexpr std::size_t kLongestLine = 2048;  // bytes: calibrations.csv has the longest, some 800

/// east … heading_deg, a comma before each; empty where there is nothing.
void append_earth(std::string* line, bool valid, const EarthNumbers& e) {
  if (!valid) {
    *line += ",,,,,,,";
    return;
  }
  const auto out = std::back_inserter(*line);
  for (const double v : e.enu) fmt::format_to(out, ",{:.4f}", v);
  // 1e-9 degrees are a tenth of a millimetre.
  fmt::format_to(out, ",{:.9f},{:.9f},{:.4f},{:.4f}", e.position.latitude_deg,
                 e.position.longitude_deg, e.position.height_m, e.heading_deg);
}

}  // namespace

void make_session_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const std::string name = folder.string();
  if (name.empty()) throw InputError("--out is empty; name a folder for the session");
  std::error_code error;
  if (fs::exists(folder, error)) {
    if (!fs::is_directory(folder, error))
      throw InputError(name +
                       ": is not a folder; name a new or empty one for the session with --out");
    const bool empty = fs::is_empty(folder, error);
    if (error)
      throw InputError(name + ": cannot be looked into (" + error.message() +
                       "): check its permissions");
    if (!empty)
      throw InputError(
          name +
          ": is not empty, and nothing is ever overwritten; name a new or empty folder with --out");
    return;
  }
  fs::create_directories(folder, error);
  if (error)
    throw InputError(name + ": cannot be made (" + error.message() +
                     "): check the folder above it");
}

Recorder::Recorder(const std::filesystem::path& folder, const Options& options)
    : options_(options),
      files_(std::make_unique<Files>(folder, options.ins)),
      totals_(std::make_unique<SessionTotals>()) {
  if (options.keep_trajectory)
    totals_->statuses.reserve(options.expected_frames > 0 ? options.expected_frames
                                                          : kMostStatuses);
  totals_->attempts.reserve(kMostAttempts);
  line_.reserve(kLongestLine);
  folder_ = folder.string();
  if (options.keep) keeper_ = std::make_unique<CalibrationKeeper>(options.keep, &filled_);
  memory_ = totals_->statuses.capacity() * sizeof(PoseStatus) +
            totals_->attempts.capacity() * sizeof(CalibrationAttempt);
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
bool Recorder::push(Ring<Value, N>* ring, std::atomic<std::uint64_t>* dropped,
                    const Value& value) noexcept {
  for (;;) {
    const WakeEvent::Ticket seen = freed_.ticket();
    if (ring->push(value)) break;
    if (options_.when_full == WhenFull::drop) {
      dropped->fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    freed_.wait(seen);
  }
  filled_.signal();
  return true;
}

void Recorder::post(const Record& record) noexcept {
  if (push(&ring_, &dropped_, record)) high_water_ = std::max(high_water_, ring_.size());
}

void Recorder::post(const InsRecord& reading) noexcept {
  (void)push(&readings_, &dropped_readings_, reading);
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
    if (reopen_.exchange(false, std::memory_order_acquire)) reopen_files();
    const bool took = take(), told = take_outcome();
    if (took || told) {
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

void WorkDropped::add(const FrameEffort& effort) noexcept {
  if (effort.whole()) return;
  ++frames;
  const bool window = effort.window_keyframes > 0 && effort.window_steps > 0;
  points += effort.points_percent < 100 ? 1 : 0;
  keyframes += window && effort.window_keyframes != FrameEffort::kAll ? 1 : 0;
  steps += window && effort.window_steps != FrameEffort::kAll ? 1 : 0;
  windows += window ? 0 : 1;
}

/// The oldest of both rings, as far as there are any. False: there were none.
bool Recorder::take() {
  Record record;
  InsRecord reading;
  const bool one = ring_.pop(&record), other = readings_.pop(&reading);
  if (!one && !other) return false;
  freed_.signal();
  if (one) std::visit([this](const auto& r) { write(r); }, record);
  if (other) write(reading);
  return true;
}

void Recorder::write(const InsRecord& reading) {
  format_ins_record(reading, &line_);
  files_->ins->append(line_);
}

void Recorder::write(const PoseRecord& p) {
  newest_ = p.stamp;
  newest_frame_ = p.frame;
  if (options_.disk_full) pretend(p.stamp);
  ++totals_->read;
  match_confirmed();
  ++(p.status == PoseStatus::ok         ? totals_->ok
     : p.status == PoseStatus::degraded ? totals_->degraded
                                        : totals_->lost);
  totals_->estimate.add(static_cast<double>(p.estimate_ms));
  if (p.state != State::stereo_odometry && p.state != State::lost)
    totals_->calibrating.add(static_cast<double>(p.estimate_ms));
  totals_->decode.add(static_cast<double>(p.decode_ms));
  totals_->work_dropped.add(p.effort);
  for (std::size_t i = 0; i < p.stage_ms.size(); ++i)
    totals_->stages[i].add(static_cast<double>(p.stage_ms[i]));

  const bool posed = p.status != PoseStatus::lost;
  line_.clear();
  const auto out = std::back_inserter(line_);
  fmt::format_to(out, "{},{},{},{},{}", p.frame, p.stamp.ns(), to_string(p.state),
                 to_string(p.status), to_string(p.reason));
  if (posed) {
    for (const double v : p.world_left.t) fmt::format_to(out, ",{:.9f}", v);
    for (const double v : p.world_left.q) fmt::format_to(out, ",{:.9f}", v);
  } else {
    line_ += ",,,,,,,";
  }
  append_earth(&line_, p.placed, p.ours);
  append_earth(&line_, p.ins_valid, p.ins);
  for (const double v : p.error)
    if (p.compared)
      fmt::format_to(out, ",{:.4f}", v);
    else
      line_ += ',';
  fmt::format_to(out, ",{}", p.inliers);
  if (posed)
    fmt::format_to(out, ",{:.4f}", p.reprojection_px);
  else
    line_ += ',';
  fmt::format_to(out, ",{:.3f}\n", p.estimate_ms);
  files_->poses.append(line_);
  if (posed) append_tum(&line_, p.stamp, p.world_left);
  const bool in_trajectory = posed && files_->trajectory.append(line_);
  if (totals_->statuses.size() < totals_->statuses.capacity())
    totals_->statuses.push_back(in_trajectory ? p.status : PoseStatus::lost);
  if (!posed) return;
  if (p.has_reference) {
    append_tum(&line_, p.stamp, p.reference_left);
    files_->reference.append(line_);
    any_reference_ = true;
  }
  if (have_last_pose_)
    totals_->path_m +=
        std::hypot(p.world_left.t[0] - last_pose_.t[0], p.world_left.t[1] - last_pose_.t[1],
                   p.world_left.t[2] - last_pose_.t[2]);
  last_pose_ = p.world_left;
  have_last_pose_ = true;
}

/// An event comes before the pose of its frame, or after the last one.
void Recorder::match_confirmed() {
  if (totals_->confirmed == newest_ && !totals_->confirmed_frame && totals_->read > 0)
    totals_->confirmed_frame = newest_frame_;
}

void Recorder::note(const EventRecord& e) {
  const std::string_view kind = e.kind;
  if (kind == "calibration_confirmed" && !totals_->confirmed) {
    totals_->confirmed = e.stamp;
    match_confirmed();
  } else if (kind == "calibration_contradicted" && !totals_->contradicted) {
    const double* percent = std::get_if<double>(&e.fields[0].value);
    totals_->contradicted = {e.stamp, percent != nullptr ? *percent : 0.0};
  }
}

void Recorder::write(const EventRecord& e) {
  note(e);
  format_event(e, &line_);
  files_->events.append(line_);
}

void Recorder::write(const CalibrationRecord& c) {
  for (int k = 1; k < c.rig.cameras; ++k) {
    format_calibration(c, k, &line_);
    files_->calibrations.append(line_);
  }
  if (c.decided) note(c);
}

void Recorder::note(const CalibrationRecord& c) {
  if (c.learnt && !c.accepted) return;  // the drive goes on: nothing was attempted
  ++(c.accepted ? totals_->accepted : totals_->rejected);
  if (totals_->attempts.size() == kMostAttempts) totals_->attempts.erase(totals_->attempts.begin());
  totals_->attempts.push_back(
      {c.stamp, c.cause, c.reason, c.accepted, c.latency_frames, c.rig.frames, c.solve_ms});
  if (!c.accepted || keeper_ == nullptr) return;
  if (!keeper_->post(c.stamp, c.rig))
    complain("a calibration is not kept: the disk has not taken those before it");
}

/// What became of a calibration. False: there is nothing new.
bool Recorder::take_outcome() {
  CalibrationKeeper::Outcome outcome;
  if (keeper_ == nullptr || !keeper_->next(&outcome)) return false;
  write(outcome.event);
  if (outcome.failed) complain("{}", outcome.event.sentence.data());
  return true;
}

void Recorder::flush() {
  const auto& files = files_->all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i]->flush())
      files_->told[i] = 0;
    else if (files_->told[i] != files[i]->fault()) {
      files_->told[i] = files[i]->fault();
      complain(*files[i]);
    }
  }
  note_disk(pretended_ || std::any_of(files.begin(), files.end(),
                                      [](const LineFile* f) { return f->fault() != 0; }));
}

void Recorder::reopen() noexcept {
  reopen_.store(true, std::memory_order_release);
  filled_.signal();
}

void Recorder::reopen_files() {
  for (LineFile* file : files_->all) {
    bool fresh = false;
    if (!file->reopen(&fresh)) complain(*file);
    if (fresh) file->append(files_->head(file));
  }
  EventRecord event;
  event.stamp = newest_;
  event.kind = "files_reopened";
  event.set_sentence("the session's files were opened again by their names, as SIGHUP asked for");
  write(event);
}

void Recorder::pretend(Stamp stamp) {
  const bool full = options_.disk_full(stamp);
  if (full == pretended_) return;
  if (full) flush();  // what came before has found room
  pretended_ = full;
  for (LineFile* file : files_->all) file->pretend_full(full);
  if (full)
    complain(
        "{}: the disk has no room, as the drive's faults want it; the session goes on, lines wait "
        "in memory",
        folder_);
  flush();
}

/// An event where the disk begins to refuse, and where it takes lines again.
void Recorder::note_disk(bool full) {
  if (full == disk_full_) return;
  disk_full_ = full;
  EventRecord event;
  event.stamp = newest_;
  event.kind = full ? "disk_full" : "disk_room";
  std::array<char, 96> room{};
  (void)fmt::format_to_n(room.begin(), room.size() - 1, "the disk takes lines again; {} were lost",
                         lost_lines());
  event.set_sentence(full ? "the disk of the session has no room: lines wait in memory"
                          : room.data());
  write(event);
}

std::uint64_t Recorder::lost_lines() const {
  std::uint64_t lines = 0;
  for (const LineFile* file : files_->all) lines += file->lost_lines();
  return lines;
}

void Recorder::complain(const LineFile& file) {
  const char* words = ::strerrordesc_np(file.fault());  // strerror() may take memory
  complain(
      "{}: cannot be written ({}); the session goes on, lines wait in memory: make room on that "
      "disk",
      file.path().native(), words != nullptr ? words : "unknown error");
}

template <class... Arguments>
void Recorder::complain(const char* format, const Arguments&... arguments) noexcept {
  Complaint complaint{};
  (void)fmt::format_to_n(complaint.begin(), complaint.size() - 1, fmt::runtime(format),
                         arguments...);
  (void)complaints_.push(complaint);
}

std::vector<std::string> Recorder::take_errors() {
  std::vector<std::string> sentences;
  for (Complaint c; complaints_.pop(&c);) sentences.emplace_back(c.data());
  sentences.insert(sentences.end(), errors_.begin(), errors_.end());
  errors_.clear();
  return sentences;
}

/// The trajectories, from the session's own files: nothing that grows with the drive waits in
/// memory.
void Recorder::read_back() {
  const auto read = [this](const LineFile& file, std::vector<StampedPose>* out) {
    try {
      *out = read_tum(file.path());
    } catch (const InputError& e) {
      errors_.push_back(std::string(e.what()) + "; the summary lacks what is made from it");
    }
  };
  if (totals_->ok + totals_->degraded > 0) read(files_->trajectory, &totals_->trajectory);
  if (any_reference_) read(files_->reference, &totals_->reference);
}

std::unique_ptr<SessionTotals> Recorder::close() {
  stop_and_join();
  if (keeper_ != nullptr) keeper_->stop();
  while (take_outcome()) {
  }
  for (LineFile* file : files_->all) {
    const bool good = file->close();
    totals_->lost_lines += file->lost_lines();
    if (!good)
      totals_->faults.push_back(file->path().string() + ": is not complete (" +
                                std::strerror(file->fault()) +
                                "); make room on that disk and repeat the drive");
    else if (file->lost_lines() > 0)
      errors_.push_back(file->path().string() + ": lacks " + std::to_string(file->lost_lines()) +
                        " lines that found no room on the disk in time; the others are all there");
  }
  // A file that says nothing would look like a reference that was lost.
  std::error_code ignored;
  if (!any_reference_) std::filesystem::remove(files_->reference.path(), ignored);
  if (options_.keep_trajectory) read_back();
  totals_->dropped_records = dropped_.load(std::memory_order_relaxed);
  totals_->dropped_readings = dropped_readings_.load(std::memory_order_relaxed);
  totals_->ring_high_water = high_water_;
  return std::move(totals_);
}

}  // namespace vergence::app
