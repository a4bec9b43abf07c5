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
  /// Time to read and decode the images; 0 if they came as pixels.
  float decode_ms = 0;
  /// Recorded state of the calibration solver at this frame, which ReplayableSolverRunner repeats.
  std::optional<bool> solver_idle{};
};

/// An event, in its order among the frames.
struct SourceEvent {
  EventRecord record{};
  /// Print the message on stderr, too.
  bool to_user = false;
  /// The event is a frame that could not be read.
  bool skipped = false;
  /// Write the event to events.jsonl.
  bool listed = true;
  /// Request a new calibration.
  bool recalibrate = false;
};

using SourceItem = std::variant<SourceFrame, InsRecord, SourceEvent>;

/// A message of the set-up.
struct SourceRemark {
  std::string message{};
  /// Kind of its event; null: it is printed only.
  const char* kind = nullptr;
  /// Print the message on stderr, too.
  bool print = true;
};

/// The INS of a source and how its readings are compared with.
struct SourceIns {
  ComparisonOptions options{};
  InsSource kind = InsSource::device;
  /// Origin of the INS extrinsics, in a few words.
  std::string mount_source{};
  /// Memory of the readings, in addition to the comparison.
  std::size_t reading_bytes = 0;
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
  /// Ground truth of a recording, the reference for an estimate without INS.
  Trajectory truth{};
  std::vector<SourceRemark> remarks{};
  /// Assumptions about a recording where it lacks data, a phrase each.
  std::vector<std::string> assumptions{};
  /// True if describe() compares the trajectory with ground truth.
  bool knows_truth = false;
  std::size_t image_bytes = 0, ring_bytes = 0;
  /// Frame interval of a live drive, whose frames do not wait; zero if they wait.
  Duration frame_interval{};
  /// Label of frames that were not used.
  const char* skipped_label = "skipped";
  /// SIGUSR1 requests a new calibration.
  bool on_request = false;
};

/// Source of a session's frames, readings and device events: devices (run_drive()) or a recorded
/// drive (run_replay()). run_session() treats both alike.
///
/// Threads  next(), done(): the estimator's, sealed. stop(): any. The rest: the caller's; finish()
///          and what comes after it when the estimator's has joined.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  [[nodiscard]] const SourceFacts& facts() const noexcept { return facts_; }

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
  virtual void finish(Progress* progress) = 0;

  /// Adds to the summary: frames skipped, devices, times, truth.
  virtual void describe(const SessionTotals& totals, const Estimator& estimator,
                        SummaryInput* input) const = 0;
  /// Exit code for a problem of the source itself, whose message it has printed; called if there
  /// are poses.
  [[nodiscard]] virtual std::optional<ExitCode> verdict(Progress* /*progress*/) const {
    return std::nullopt;
  }

 protected:
  SourceFacts facts_{};  // set by the constructor
};

}  // namespace vergence::app
