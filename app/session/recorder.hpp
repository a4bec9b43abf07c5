#pragma once
#include <chrono>
#include <functional>
#include <memory>

#include "app/runtime/queue_thread.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"

namespace vergence::app {

/// Writes trajectory.tum, reference.tum (removed at the end without a reference), poses.csv,
/// events.jsonl and, with an INS, ins.csv of a session during the run, on its own thread, so that
/// the estimator never waits for a disk.
///
///     make_session_folder("sessions/monday");
///     Recorder recorder("sessions/monday", {});
///     recorder.on_report(report);  // of each frame
///     const std::unique_ptr<SessionTotals> totals = recorder.close();
///
/// Records reach the files within a second, so a killed session keeps its lines. Stamps are printed
/// as integers. Equal records give equal bytes.
/// Threads  One producer calls on_…(), one consumer pop_errors(), the owner close() after both. The
///          recorder's thread is sealed.
/// Memory   Fixed for any length of the run; with keep_trajectory close() reads the trajectories
///          back from their files.
/// Full     wait: the producer waits (replay). drop: the record is dropped and counted (live). INS
///          samples leave room for poses and events.
/// Errors   The constructor throws InputError. A full disk gives an error and an event `disk_full`;
///          lines wait in LineFile and are written again every kRetry to the same files. An event
///          `disk_recovered` with the number of lost lines follows. A file that lacks lines is a
///          fault of the totals.
class Recorder final : public SessionObserver {
 public:
  struct Options {
    WhenFull when_full = WhenFull::wait;
    bool keep_trajectory = true;
    /// Records INS samples in ins.csv.
    bool ins = false;
    /// Stamp of the recorder's own events before the first pose.
    Stamp first{};
    /// Returns true while the disk is to be treated as full, for the mock's fault. Called on the
    /// recorder's thread with the stamp of every pose. May be empty.
    std::function<bool(Stamp)> disk_full{};
  };

  /// `folder` must exist, see make_session_folder().
  Recorder(const std::filesystem::path& folder, const Options& options);
  ~Recorder() override;

  void on_report(const FrameReport& report) noexcept override { post(report); }
  void on_event(const EventRecord& event) noexcept override { post(event); }
  /// Precondition: Options::ins.
  void on_reading(const InsRecord& reading) noexcept override {
    if (!thread_.post(reading, kOfPoses)) ++dropped_readings_;
  }

  /// Bytes allocated at construction for waiting lines.
  [[nodiscard]] std::size_t memory() const noexcept { return memory_; }
  /// Messages about the disk since the last call.
  [[nodiscard]] std::vector<std::string> pop_errors();
  /// Writes the waiting lines and closes the files. Call once.
  [[nodiscard]] std::unique_ptr<SessionTotals> close();

 private:
  // Interval of attempts to write.
  static constexpr std::chrono::seconds kRetry{3};
  // Number of records: 2 s of the fastest INS and its frames.
  static constexpr std::size_t kRing = 1024;
  // Number of records that INS samples must leave free for poses and events.
  static constexpr std::size_t kOfPoses = 128;

  using Record = std::variant<FrameReport, EventRecord, InsRecord>;
  void begin();
  void process(const Record* record);
  void post(const Record& record) noexcept {
    if (!thread_.post(record)) ++dropped_records_;
  }

  void write(const FrameReport& report);
  void write(const EventRecord& event);
  void write(const InsRecord& reading);
  void flush();
  void pretend(Stamp stamp);
  void record_disk(const LineFile* failed, int fault);
  [[nodiscard]] std::uint64_t lost_lines() const;
  // Null-terminated text, truncated at the end of the array.
  using ErrorMessage = std::array<char, 512>;
  void read_back();

  struct Files;
  Options options_;
  std::unique_ptr<Files> files_;
  std::unique_ptr<SessionTotals> totals_ = std::make_unique<SessionTotals>();
  // Buffer of the line that is being formatted.
  std::string line_;
  std::size_t memory_ = 0;
  // Newest stamp of the poses.
  Stamp newest_;
  bool disk_full_ = false, pretended_ = false;
  // Valid while disk_full_.
  std::chrono::steady_clock::time_point retry_due_{};

  std::chrono::steady_clock::time_point flushed_{}, written_back_{};
  // If full, the newest messages are lost.
  Ring<ErrorMessage, 16> error_messages_;
  // Errors of close().
  std::vector<std::string> errors_;
  // Counted by the producer.
  std::uint64_t dropped_records_ = 0, dropped_readings_ = 0;
  QueueThread<Record, kRing> thread_;
};

}  // namespace vergence::app
