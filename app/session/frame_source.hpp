#pragma once
#include "app/datasets/trajectory_files.hpp"
#include "app/recording/session_description.hpp"
#include "app/runtime/errors.hpp"
#include "app/session/recorder.hpp"
#include "app/session/starting_calibration.hpp"
#include "app/session/summary.hpp"
#include "drivers/acquisition/acquired.hpp"

namespace vergence::app {

/// Rig frame for the estimator; its slots belong to the session until FrameSource::done().
struct SourceFrame {
  RigFrame rig{};
  /// Time to read and decode the images; 0 if they came as pixels.
  float decode_ms = 0;
  /// Recorded state of the calibration solver at this frame, which ReplayableSolverRunner repeats.
  std::optional<bool> solver_idle{};
};

/// Event, in its order among the frames.
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

/// Message from the set-up.
struct SourceRemark {
  std::string message{};
  /// Kind of its event; null if it is only printed.
  const char* kind = nullptr;
  /// Print the message on stderr, too.
  bool print = true;
};

/// INS of a source, and the options of its comparison.
struct SourceIns {
  ComparisonOptions options{};
  InsSource kind = InsSource::device;
  /// Origin of the INS extrinsics, in a few words.
  std::string mount_source{};
  /// Memory of the samples, in addition to that of the comparison.
  std::size_t reading_bytes = 0;
};

/// Properties of a source before the first frame.
struct SourceFacts {
  StartingCalibration begin{};
  Adoption adoption = Adoption::after_fixed_frames;
  /// Policy when the session's files fall behind.
  WhenFull when_full = WhenFull::wait;
  /// Value of Recorder::Options.
  std::function<bool(Stamp)> disk_full{};
  /// Total number of frames; 0 if unknown.
  std::uint64_t frames = 0;
  /// First stamp.
  Stamp first{};
  /// Maps stamps to this machine's clock, in real time.
  std::optional<ClockTie> tie{};
  std::optional<SourceIns> ins{};
  /// Ground truth of a recording, the reference for an estimate without INS.
  Trajectory truth{};
  std::vector<SourceRemark> remarks{};
  /// Assumptions about a recording that replace missing data, one phrase each.
  std::vector<std::string> assumptions{};
  /// True if describe() compares the trajectory with ground truth.
  bool knows_truth = false;
  std::size_t image_bytes = 0, ring_bytes = 0;
  /// Frame interval of a live run, whose frames do not wait; zero if they wait.
  Duration frame_interval{};
  /// Label of frames that were not used.
  const char* skipped_label = "skipped";
  /// SIGUSR1 requests a new calibration.
  bool on_request = false;
};

/// Source of a session's frames, INS samples and device events: devices (run_drive()) or a
/// recording (run_replay()). run_session() treats both alike.
///
/// next() and done() run on the estimator's thread, which is sealed. stop() is thread-safe. The
/// caller makes the other calls; finish() and later ones after the estimator's thread was joined.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Valid after construction.
  [[nodiscard]] const SourceFacts& facts() const noexcept { return facts_; }

  /// Call before start(): `observer` receives the trigger board's pulses and must outlive the
  /// source.
  virtual void observe_pulses(PulseObserver* /*observer*/) {}
  /// Starts the stream; the session's files are open. Problems of files go to *faults. Throws
  /// InputError if a device does not start.
  virtual void start(std::vector<std::string>* /*faults*/) {}
  /// Waits for the next item. Returns false once the run is over or stopped.
  [[nodiscard]] virtual bool next(SourceItem* item) noexcept = 0;
  /// Takes back the slots of the last frame, whose pose is known.
  virtual void done(const PoseSample& /*sample*/) noexcept {}
  virtual void stop() noexcept = 0;
  /// Number of iterations of the thread behind next(), with or without data; it stops growing if
  /// the thread hangs. Thread-safe. Always 0 if not counted.
  [[nodiscard]] virtual std::uint64_t rounds() const noexcept { return 0; }
  /// Called every 50 ms during the run.
  virtual void poll() {}
  /// Called once after next() has ended, while the estimator may still finish; stops the delivery.
  virtual void halt() noexcept {}
  /// Ends what start() began, after halt().
  virtual void finish(Progress* progress) = 0;

  /// Adds skipped frames, devices, times and ground truth to the summary.
  virtual void describe(const SessionTotals& totals, const Estimator& estimator,
                        SummaryInput* input) const = 0;
  /// Prints the statistics shown at the end.
  virtual void print_metrics(const SummaryInput& input, Progress* progress) const = 0;
  /// Exit code for a problem of the source itself, whose message it has printed; called if there
  /// are poses.
  [[nodiscard]] virtual std::optional<ExitCode> verdict(Progress* /*progress*/) const {
    return std::nullopt;
  }

 protected:
  SourceFacts facts_{};
};

}  // namespace vergence::app
