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

/// The devices of a configuration as the source of a session: cameras, INS and board, real or a
/// mock's.
///
/// Ownership  Holds the devices. `request` outlives it.
/// Errors     The constructor throws InputError: configuration; DeviceError: devices that are not
///            there.
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
  // Time when the run ends, if it has a duration.
  [[nodiscard]] std::chrono::steady_clock::time_point end() const;
  void make_facts();
  void make_acquisition();
  /// An event that goes before the frame in hand. False: none is left.
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
  // First stamp of the run.
  Stamp start_{};
  std::chrono::steady_clock::time_point begun_{};
  std::vector<StampedPose> truth_;

  // Used by the estimator's thread; read by others after it has joined.
  TimingMonitor time_;
  std::vector<bool> fault_logged_;
  // Last item returned, or the one that waits until its events have been returned.
  Acquired in_hand_{};
  // True if `in_hand_` is a frame that was not returned yet.
  bool waiting_ = false;
};

/// Drives: the cameras, INS and board of the configuration into a session folder (run_session()).
///
/// Errors   InputError, DeviceError before the session folder is made, for all that can be known by
///          then. Afterwards messages on stderr.
/// → as run_session(); device_failed: a camera was disconnected at the end
[[nodiscard]] ExitCode run_drive(const RunRequest& request);

}  // namespace vergence::app
