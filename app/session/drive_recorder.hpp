#pragma once
#include "app/recording/recording.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/session/frame_source.hpp"

namespace vergence::app {

/// Queues of a recording, one per producer thread.
enum Queue : std::size_t { estimator_queue, acquisition_queue };

/// Records a session into drive.mcap as configured by `record` (docs/session_files.md).
///
/// Configuration, facts and watch must outlive it. Threads as in SessionObserver and PulseObserver,
/// with a queue each; the owner makes the other calls. The queues are allocated at construction.
/// The constructor throws InputError without room or file; later errors are messages.
class DriveRecorder final : public SessionObserver, public PulseObserver {
 public:
  /// `folder` is the session's directory and must exist. Precondition: configuration.record.any().
  DriveRecorder(const std::filesystem::path& folder, const Configuration& configuration,
                const SourceFacts& facts, const ReplayableSolverRunner& watch);

  void on_frame(const RigFrame& frame) noexcept override;
  void on_pose(const FrameReport& report) noexcept override;
  void on_reading(const InsRecord& reading) noexcept override;
  void on_event(const EventRecord& event) noexcept override;
  void on_calibration(const CalibrationRecord& calibration) noexcept override;

  void on_pulse(Stamp arrival, const Pulse& pulse, Stamp edge) noexcept override;

  /// Messages about the disk since the last call.
  [[nodiscard]] std::vector<std::string> pop_errors() { return recording_.pop_errors(); }
  /// Ends the files. Losses by a disk failure become a message in *faults.
  void close(std::vector<std::string>* faults);
  /// Ends recording. Called on the estimator's thread.
  void stop() noexcept { stopped_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override;
  [[nodiscard]] std::size_t memory() const noexcept { return recording_.counters().queue_bytes; }

 private:
  template <class Write>
  bool post(std::size_t topic, Stamp stamp, const Write& write, std::size_t queue = estimator_queue,
            std::size_t most = kMessageRoom, bool bulky = false) noexcept;
  void post_image(const RigFrame& frame, std::size_t camera) noexcept;
  void post_rig(Stamp stamp) noexcept;
  /// Each file of a split recording has the rig, so that it can be read without the others.
  [[nodiscard]] bool rig_is_due() const noexcept {
    return calibrated_ && rig_in_file_ != recording_.counters().files;
  }

  const RecordSettings& settings_;
  const ReplayableSolverRunner& watch_;
  // Frames of reference of the cameras.
  std::vector<std::string> frames_;
  const std::string folder_;
  Recording recording_;

  // Used by the estimator's thread only.
  RigCalibration rig_;
  bool calibrated_ = false, recalibrate_ = false;
  // Number of files when the rig was last posted.
  std::optional<std::uint64_t> rig_in_file_{};
  std::atomic<bool> stopped_{false};
  FrameRecord frame_{};
};

}  // namespace vergence::app
