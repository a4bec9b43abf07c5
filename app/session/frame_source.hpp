#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "app/datasets/trajectory_files.hpp"
#include "app/recording/session_description.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/progress.hpp"
#include "app/session/ins_comparison.hpp"
#include "app/session/ins_file.hpp"
#include "app/session/recorder.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/starting_calibration.hpp"
#include "app/session/summary.hpp"
#include "drivers/acquisition/acquired.hpp"

namespace vergence::app {

/// A rig frame for the estimator; its slots are the session's until FrameSource::done().
struct SourceFrame {
  RigFrame rig{};
  float decode_ms = 0;  // reading and decoding its images; 0 where they came as pixels
  std::optional<bool>
      solver_idle{};  // of a recorded drive: what the calibration solver answered
                      // at this frame, and is to answer again (ReplayableSolverRunner)
};

/// An event, in its order among the frames.
struct SourceEvent {
  EventRecord record{};
  bool to_user = false;      // on stderr, too
  bool skipped = false;      // it is a frame that could not be read
  bool listed = true;        // in events.jsonl
  bool recalibrate = false;  // a new calibration is to be sought
};

using SourceItem = std::variant<SourceFrame, InsRecord, SourceEvent>;

/// A message of the set-up.
struct SourceRemark {
  std::string message{};
  const char* kind = nullptr;  // of its event; null: it is only said
  bool print = true;           // on stderr, too
};

/// The INS of a source and how its readings are compared with.
struct SourceIns {
  ComparisonOptions options{};
  InsSource kind = InsSource::device;
  std::string mount_source{};     // a few words: where the mount of the options is from
  std::size_t reading_bytes = 0;  // held beside the comparison
};

/// Properties of a source before the first frame.
struct SourceFacts {
  StartingCalibration begin{};
  Adoption adoption = Adoption::after_fixed_frames;
  WhenFull when_full = WhenFull::wait;     // the session's files fall behind
  std::function<bool(Stamp)> disk_full{};  // of Recorder::Options
  std::uint64_t frames = 0;                // of the whole drive; 0 if unknown
  Stamp first{};                           // of the drive
  std::optional<ClockTie> tie{};           // of stamps to this machine's clock, in real time
  std::optional<SourceIns> ins{};
  Trajectory truth{};  // that came with a recording: what an estimate without INS is compared with
  std::vector<SourceRemark> remarks{};
  std::vector<std::string> assumptions{};  // of a recording: what nobody said, a phrase each
  bool knows_truth = false;  // at the drive's end describe() holds its trajectory against it
  std::size_t image_bytes = 0, ring_bytes = 0;
  Duration frame_interval{};  // of a live drive, whose frames do not wait; zero: they do
  const char* skipped_label = "skipped";  // frames of the drive that nobody estimated from
  bool on_request = false;                // SIGUSR1 asks for a new calibration
};

/// Source of a session's frames, readings and device events: devices (LiveSource) or a recorded
/// drive (RecordedSource). run_session() treats both alike.
///
/// Threads  next(), done(): the estimator's, sealed. stop(): any. The rest: the caller's; finish()
///          and what comes after it when the estimator's has joined.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  [[nodiscard]] virtual const SourceFacts& facts() const noexcept = 0;

  /// Before start(): `observer` receives the trigger board's pulses, if there is one, and outlives
  /// the source.
  virtual void observe_pulses(PulseObserver* /*observer*/) {}
  /// Begins the stream; the session's files are open. What is wrong with a file goes to *faults.
  /// InputError: a device does not start.
  virtual void start(std::vector<std::string>* faults) = 0;
  /// The next item, waiting for it. False: the drive is over, or stopped.
  [[nodiscard]] virtual bool next(SourceItem* item) noexcept = 0;
  /// The frame that next() gave last has its pose: takes the slots back.
  virtual void done(const PoseSample& sample) noexcept = 0;
  virtual void stop() noexcept = 0;
  /// Number of iterations of the thread behind next(), with or without data: a thread whose number
  /// no longer grows hangs. Any thread. Always 0 if it is not counted.
  [[nodiscard]] virtual std::uint64_t rounds() const noexcept { return 0; }
  /// Called every 50 ms while frames come.
  virtual void poll() {}
  /// Called once when next() has ended, which the estimator may take time to conclude: stops what
  /// still delivers.
  virtual void halt() noexcept {}
  /// Ends what start() began, after halt().
  virtual void finish(Progress* progress, std::vector<std::string>* faults) = 0;

  /// Adds to the summary: frames skipped, devices, times, truth.
  virtual void describe(const SessionTotals& totals, const Estimator& estimator,
                        SummaryInput* input) const = 0;
  /// Prints the statistics shown at the end.
  virtual void print_metrics(const SessionTotals& totals, const SummaryInput& input,
                             Progress* progress) const = 0;
  /// Exit code for a problem of the source itself, whose message it has printed; called if there
  /// are poses.
  [[nodiscard]] virtual std::optional<ExitCode> verdict(Progress* /*progress*/) const {
    return std::nullopt;
  }
};

}  // namespace vergence::app
