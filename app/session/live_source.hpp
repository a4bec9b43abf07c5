#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/devices/exposure_control.hpp"
#include "app/runtime/errors.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/session_runner.hpp"
#include "app/session/starting_calibration.hpp"
#include "app/session/timing_monitor.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// Request of a live run.
struct RunRequest {
  SessionOptions session{};
  Configuration configuration;
  /// Value of --from-scratch and --calibration.
  CalibrationSource calibration{};
  /// Faults of the command line, in addition to the configuration's.
  std::vector<std::string> faults;
  /// Empty runs to the end.
  std::optional<double> duration_s;
  /// Virtual time, in which nothing is dropped.
  bool fast = false;
};

/// Source with the devices of a configuration: cameras, INS and trigger board, real or simulated.
///
/// Owns the devices. `request` must outlive it. The constructor throws InputError (configuration)
/// and DeviceError (missing devices).
class LiveSource final : public FrameSource {
 public:
  explicit LiveSource(const RunRequest& request);

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void observe_pulses(PulseObserver* observer) override { pulse_observer_ = observer; }
  void start(std::vector<std::string>* faults) override;
  [[nodiscard]] bool next(SourceItem* item) noexcept override;
  void done(const PoseSample& sample) noexcept override;
  void stop() noexcept override { acquisition_->stop(); }
  [[nodiscard]] std::uint64_t rounds() const noexcept override { return acquisition_->rounds(); }
  void poll() override;
  void halt() noexcept override;
  void finish(Progress* progress, std::vector<std::string>* faults) override;
  void describe(const SessionTotals& totals, const Estimator& estimator,
                SummaryInput* input) const override;
  void print_metrics(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const override;
  [[nodiscard]] std::optional<ExitCode> verdict(Progress* progress) const override;

 private:
  // End of a run with a duration.
  [[nodiscard]] std::chrono::steady_clock::time_point end() const;
  void make_facts();
  void make_acquisition();
  /// Returns an event that precedes the frame in hand; false if none is left.
  [[nodiscard]] bool next_event(SourceItem* item) noexcept;
  void write_truth(std::vector<std::string>* faults) const;
  [[nodiscard]] TruthMetrics truth_metrics(const SessionTotals& totals,
                                           const Estimator& estimator) const;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

  const RunRequest& request_;
  const Configuration& configuration_;
  DriveDevices devices_;
  SourceFacts facts_;
  // Null if exposures are fixed.
  std::unique_ptr<ExposureControl> exposure_;
  // Null if pulses are not recorded.
  PulseObserver* pulse_observer_ = nullptr;
  std::unique_ptr<Acquisition> acquisition_;
  // Start of the run.
  Stamp start_{};
  std::chrono::steady_clock::time_point begun_{};
  std::vector<StampedPose> truth_;

  // Used by the estimator's thread; read by others after joining it.
  TimingMonitor time_;
  std::vector<bool> fault_logged_;
  // Item returned, or held back behind its events.
  Acquired in_hand_{};
  // True if in_hand_ is a frame that was not returned yet.
  bool waiting_ = false;
};

/// Runs the cameras, INS and trigger board of the configuration into a session directory
/// (run_session()). Throws InputError or DeviceError before the directory is made, as far as
/// possible; later errors are messages on stderr. Returns as run_session(), or device_failed if a
/// camera was disconnected at the end.
[[nodiscard]] ExitCode run_drive(const RunRequest& request);

}  // namespace vergence::app
