#pragma once
#include <atomic>
#include <memory>
#include <optional>

#include "app/datasets/reference_track.hpp"
#include "app/devices/camera_masks.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/session/calibration_writer.hpp"
#include "app/session/drive_recorder.hpp"
#include "app/session/event_log.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/ins_comparison.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_runner.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/arena.hpp"

namespace vergence::app {

/// Loop of the estimator's thread: takes input from the source, estimates its pose, compares it
/// with the INS, and hands everything on to the session's output.
///
/// Threads  run(): the estimator's, sealed. ask_calibration(), drained(), items(), waiting(): any.
///          Everything else: the owner's, before run() or after its thread has joined, but for
///          event_log()'s show().
/// Memory   Arenas, at construction.
class EstimationLoop {
 public:
  /// The arguments must outlive this object.
  EstimationLoop(FrameSource& source, const Configuration& configuration,
                 const SessionOptions& options);

  /// Before run(). `recording`: what viewers may stop; null: nothing is recorded. `calibrations`:
  /// whose outcomes become events.
  void open(const SessionOutput& output, DriveRecorder* recording,
            CalibrationWriter* calibrations) noexcept;
  /// Logs the outcomes of saving calibrations. The estimator's thread, or after it was joined.
  void log_kept_calibrations() noexcept;
  /// Runs until the source is exhausted.
  void run() noexcept;
  /// Requests a new calibration; acts at the next frame.
  void ask_calibration() noexcept { calibration_asked_.store(true, std::memory_order_relaxed); }
  /// True if the source has given its last item; the estimator may still be deciding a calibration.
  [[nodiscard]] bool drained() const noexcept { return drained_.load(std::memory_order_acquire); }
  /// Number of items handled so far.
  [[nodiscard]] std::uint64_t items() const noexcept {
    return beat_.items.load(std::memory_order_relaxed);
  }
  /// True while the loop waits for the source's next item.
  [[nodiscard]] bool waiting() const noexcept {
    return beat_.waiting.load(std::memory_order_relaxed);
  }

  [[nodiscard]] EventLog& event_log() noexcept { return log_; }
  [[nodiscard]] const EventLog& event_log() const noexcept { return log_; }
  [[nodiscard]] SessionOutput& output() noexcept { return output_; }
  [[nodiscard]] const Estimator& estimator() const noexcept { return *estimator_; }
  [[nodiscard]] const EstimatorOptions& options() const noexcept { return options_; }
  /// Null without an INS.
  [[nodiscard]] const InsComparison* comparison() const noexcept { return comparison_.get(); }
  [[nodiscard]] const ReplayableSolverRunner& solver_watch() const noexcept {
    return watched_solver_;
  }
  [[nodiscard]] const Arena& estimator_arena() const noexcept { return estimator_arena_; }
  [[nodiscard]] const Arena& comparison_arena() const noexcept { return comparison_arena_; }

 private:
  // Progress of the loop for the hang detection.
  struct Beat {
    std::atomic<std::uint64_t> items{0};
    std::atomic<bool> waiting{false};
  };
  [[nodiscard]] bool next(SourceItem* item) noexcept;
  void handle(const SourceFrame& frame) noexcept;
  void handle(const InsRecord& reading) noexcept { comparison_->add(reading); }
  void handle(const SourceEvent& event) noexcept;
  [[nodiscard]] FrameReport report(const SourceFrame& frame, const PoseSample& sample) noexcept;
  void request_recalibration(Stamp stamp, const char* message) noexcept;
  void poll_requests(Stamp stamp) noexcept;

  FrameSource& source_;
  const SourceFacts& facts_;
  // Null if no requests are possible.
  SessionRequests* const requests_;
  const ReferenceTrack reference_;
  const CameraMasks masks_;
  const EstimatorOptions options_;
  Arena estimator_arena_, comparison_arena_;
  std::unique_ptr<PairRunner> runner_;
  BackgroundThread solver_;
  ReplayableSolverRunner watched_solver_{solver_};
  std::unique_ptr<Estimator> estimator_;
  DriveRecorder* recording_ = nullptr;
  CalibrationWriter* calibrations_ = nullptr;
  SessionOutput output_;
  EventLog log_;
  std::unique_ptr<InsComparison> comparison_;
  FrameCounts counts_{};
  std::optional<std::uint64_t> newest_number_{};
  std::optional<Vec3> newest_position_{};
  std::atomic<bool> calibration_asked_{false}, drained_{false};
  Beat beat_;
  // True after the first frame.
  bool delivering_ = false;
};

}  // namespace vergence::app
