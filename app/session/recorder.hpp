#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "app/session/ins_file.hpp"
#include "app/session/records.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"
#include "core/memory/ring.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// Result of saving a calibration: a line of events.jsonl, an error of the
/// session as well when it failed.
struct Kept {
  bool failed = false;
  std::string message{};  // empty: nothing to tell
};

/// Keeps a calibration. `found`: by the drive; else it is the one that the drive began with and has
/// confirmed.
using KeepCalibration = std::function<Kept(const RigCalibration& rig, bool found)>;

/// Keeps calibrations for the next drive, on a thread of its own (`vergence-state`): making YAML
/// takes heap memory, and its files wait for the disk, which the recorder's thread does not.
///
/// Threads  One, the recorder's; stop() after the last to be kept.
/// Memory   Fixed for the recorder's thread; what `keep` takes is its thread's.
/// Full     While kMaxWaiting wait for the disk a further one is refused.
class CalibrationStateWriter {
 public:
  static constexpr std::size_t kMaxWaiting = 4;  // they come seconds apart

  /// Outcome of a calibration.
  struct Outcome {
    EventRecord event{};  // `calibration_saved` or `calibration_save_failed`
    bool failed = false;
  };

  /// `keep` is called on the keeper's thread; *wake is signalled when next() has something.
  CalibrationStateWriter(KeepCalibration keep, WakeEvent* wake);
  ~CalibrationStateWriter() { stop(); }
  CalibrationStateWriter(const CalibrationStateWriter&) = delete;
  CalibrationStateWriter& operator=(const CalibrationStateWriter&) = delete;

  /// Sets the initial calibration. It is saved if it is verified before another one is found.
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
  Ring<Waiting, kMaxWaiting> waiting_;
  Ring<Outcome, 2 * kMaxWaiting> outcomes_;  // full: the recorder hangs, its events are lost anyway
  WakeEvent filled_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class LineFile;

/// Columns of calibrations.csv: rotation vectors and their sigmas in rad, lengths in m, `sigma_` by
/// noise alone, `sigma_total_` with uncertain intrinsics, pixels; d0 … d3 are k1 k2 p1 p2, or k1 …
/// k4 of an equidistant lens. Latency in frames since the alarm, the request or the start; held-out
/// errors are medians before and after. `kept`: what the drive measured is no better than what is
/// in use. The last five are those of CalibrationDecision.
inline constexpr const char* kCalibrationsHeader =
    "stamp_ns,outcome,cause,reason,frames,latency_frames,onset_frame,reprojection_px,held_out_"
    "before_px,held_out_after_px,scale_sigma,"
    "camera,rx,ry,rz,tx,ty,tz,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,sigma_total_rx,"
    "sigma_total_"
    "ry,sigma_total_rz,sigma_total_tx,sigma_total_ty,sigma_total_tz,"
    "fx,fy,cx,cy,sigma_fx,sigma_fy,sigma_cx,sigma_cy,d0,d1,d2,d3,sigma_d0,sigma_d1,sigma_d2,sigma_"
    "d3,"
    "left_d0,left_d1,left_d2,left_d3,sigma_left_d0,sigma_left_d1,sigma_left_d2,sigma_left_d3,"
    "reference_depth_m,depth_sigma_percent,depth_error_percent,verified,lenses";

/// Writes trajectory.tum, reference.tum (gone at the end if there was no reference), poses.csv,
/// calibrations.csv, events.jsonl and, with an INS, ins.csv of a session as it goes on, on a thread
/// of its own: the estimator never waits for a disk.
///
///     make_session_folder("sessions/monday");
///     Recorder recorder("sessions/monday", {});
///     recorder.on_report(FrameReport::of(sample, 0, std::nullopt));  // of each frame
///     const std::unique_ptr<SessionTotals> totals = recorder.close();
///
/// Posted records reach the files at the latest after a
/// second, so a killed session keeps its lines. Stamps are printed from their integers. The same
/// records give the same bytes.
/// Threads  on_…(): one producer. take_errors(): one consumer. close(): the owner's, after the
///          last of these. The recorder's own is sealed: what takes heap memory is done by others.
/// Memory   Fixed, whatever the length of the drive; with keep_trajectory close() reads the
///          trajectories back from their files.
/// Full     wait: the producer waits (replay). drop: the record is dropped and counted (live).
///          Readings have a ring of their own: they never push out a pose. So have calibrations,
///          which poses would push out while the disk stands still; they are written in their turn.
/// Errors   The constructor throws InputError. When the disk takes no more: an error and an event
///          `disk_full`; lines wait as LineFile says, and are written again every kRetry to the
///          files that were opened at the start. An event `disk_recovered` when all was taken, with
///          the number of lines lost. A file that lacks lines is a fault of the totals.
class Recorder final : public SessionObserver {
 public:
  enum class WhenFull : std::uint8_t { wait, drop };
  struct Options {
    WhenFull when_full = WhenFull::wait;
    bool keep_trajectory = true;
    bool ins = false;  // readings are posted: ins.csv is there
    Stamp first{};     // of the recorder's own events before the first pose
    /// Called on a thread of its own with every calibration that was accepted while driving, and
    /// with the one that the drive began with when it is confirmed first: files may be written
    /// there. May be empty.
    KeepCalibration keep{};
    /// Returns true if a fault of the simulated rig makes the disk full at this time; it
    /// is called on the recorder's thread with the stamp of every pose. May be empty.
    std::function<bool(Stamp)> disk_full{};
  };

  /// `folder` exists: make_session_folder().
  Recorder(const std::filesystem::path& folder, const Options& options);
  ~Recorder() override;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void on_report(const FrameReport& report) noexcept override { post(report); }
  void on_event(const EventRecord& event) noexcept override { post(event); }
  void on_calibration(const CalibrationRecord& calibration) noexcept override;
  /// Precondition: Options::ins.
  void on_reading(const InsRecord& reading) noexcept override;
  /// Bytes taken at the beginning: lines that may wait, attempts to calibrate.
  [[nodiscard]] std::size_t memory() const noexcept { return memory_; }
  /// Messages about the disk since the last call.
  [[nodiscard]] std::vector<std::string> take_errors();
  /// Writes what is waiting, closes the files. Once.
  [[nodiscard]] std::unique_ptr<SessionTotals> close();

 private:
  static constexpr std::chrono::seconds kRetry{3};  // between two attempts to write
  static constexpr std::size_t kRing = 128;         // records: seconds of frames with their events
  static constexpr std::size_t kReadings = 1024;    // 2.5 s of the fastest INS
  static constexpr std::size_t kCalibrations = 8;   // they come seconds apart

  using Record = std::variant<FrameReport, EventRecord>;
  /// Queue of values for the recorder's thread.
  template <class Value, std::size_t N>
  struct Queue {
    Ring<Value, N> ring{};
    std::atomic<std::uint64_t> dropped{0};
    std::size_t high_water = 0;  // the producer's
  };
  /// A calibration, and how many records had been taken into their ring before it.
  struct Placed {
    CalibrationRecord calibration{};
    std::uint64_t after = 0;
  };
  /// Orders calibrations among the records.
  struct Turn {
    std::uint64_t posted = 0;      // records; the producer's
    std::uint64_t written = 0;     // records; of the recorder's thread, as the next
    std::optional<Placed> next{};  // whose turn has not come yet
  };
  /// False: dropped.
  template <class Value, std::size_t N>
  bool push(Queue<Value, N>* queue, const Value& value) noexcept;
  void work();
  bool take();
  bool take_calibrations();
  bool take_outcome();
  void post(const Record& record) noexcept;
  void write(const FrameReport& report);
  void write(const EventRecord& event);
  void write(const CalibrationRecord& calibration);
  void write(const InsRecord& reading);
  void report_kept(bool kept) noexcept;
  void flush();
  void pretend(Stamp stamp);
  void record_disk(const LineFile* failed, int fault);
  [[nodiscard]] std::uint64_t lost_lines() const;
  void stop_and_join() noexcept;
  using ErrorMessage = std::array<char, 512>;  // ends with 0, cut at the array's end
  template <class... Arguments>
  void report_error(const char* format, const Arguments&... arguments) noexcept;
  void read_back();

  struct Files;
  Options options_;
  std::unique_ptr<Files> files_;
  TotalsBuilder totals_;
  std::string line_;  // being formatted
  std::size_t memory_ = 0;
  Stamp newest_;  // of the poses
  bool disk_full_ = false, pretended_ = false;
  std::chrono::steady_clock::time_point retry_due_{};  // while disk_full_

  Queue<Record, kRing> records_;
  Queue<InsRecord, kReadings> readings_;
  Queue<Placed, kCalibrations> calibrations_;
  Turn turn_;
  WakeEvent filled_, freed_;
  std::atomic<bool> stop_{false};
  Ring<ErrorMessage, 16> error_messages_;           // full: the newest are lost
  std::vector<std::string> errors_;                 // of close()
  std::unique_ptr<CalibrationStateWriter> keeper_;  // null: nothing is kept
  std::thread thread_;
};

}  // namespace vergence::app
