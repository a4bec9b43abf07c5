#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/datasets/device_recording.hpp"
#include "app/datasets/recorded_session.hpp"
#include "app/device_replay/replayed_devices.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"
#include "app/session/timing_monitor.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// A recorded drive from its devices on: bytes of INS and board through their drivers, frames and
/// pulses through clocks and synchroniser, as in the drive. What comes out is compared with what
/// the estimator was given then; where it is the same, so are the poses. A set that it was not
/// given (dropped for a newer one) it is not given now.
///
/// Ownership  Holds the recording. `request` outlives it.
/// Errors     The constructor throws InputError: as SessionSource and ReplayedDevices.
class DeviceReplaySource final : public FrameSource {
 public:
  /// `other`: as SessionSource's.
  DeviceReplaySource(const ReplayRequest& request, RecordedSession session,
                     std::optional<StartingCalibration> other);

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* faults) override;
  [[nodiscard]] bool next(SourceItem* item) noexcept override;
  void done(const PoseSample& sample) noexcept override;
  void stop() noexcept override { acquisition_->stop(); }
  void halt() noexcept override;
  void finish(Progress* progress, std::vector<std::string>* faults) override;
  void describe(const SessionTotals& totals, const Estimator& estimator,
                SummaryInput* input) const override;
  void print_figures(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const override;

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// What came out as in the drive, and what did not.
  struct Comparison {
    std::uint64_t frames = 0, frames_same = 0;      // of those that the estimator was given
    std::uint64_t readings = 0, readings_same = 0;  // of those that were recorded
    std::uint64_t not_given = 0;                    // sets that no frame was made of in the drive
    Duration worst_stamp{};                         // distance of a frame's stamps
    std::uint64_t first_other = 0;  // number of the first frame that is not the same
  };

  void tie_images_to_frames();
  [[nodiscard]] ImageView pixels(std::size_t camera, std::size_t frame) noexcept;
  /// The recorded frame that has this image; kNone: no frame has.
  [[nodiscard]] std::size_t frame_of(std::size_t camera, Stamp arrival) const noexcept;
  [[nodiscard]] std::size_t frame_of(const SyncedSet& set) const noexcept;
  /// False: the estimator was not given it.
  [[nodiscard]] bool take(const AcquiredFrame& frame, SourceItem* item) noexcept;
  void compare(const AcquiredFrame& frame, std::size_t recorded) noexcept;
  void compare(const InsSample& sample) noexcept;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

  const ReplayRequest& request_;
  const RecordedSession session_;
  const DeviceRecording recording_;
  const bool other_;  // another beginning than the drive's
  const std::size_t end_;
  SourceFacts facts_;
  std::array<std::vector<std::pair<Stamp, std::size_t>>, kMaxCameras> frames_by_arrival_;
  std::array<std::vector<std::uint8_t>, kMaxCameras> pixels_;  // of the frame in hand
  ReplayedDevices devices_;
  TimingMonitor time_;
  std::unique_ptr<Acquisition> acquisition_;

  // Of the estimator's thread; read by others after it has joined.
  AcquiredFrame in_hand_{};
  bool holding_ = false;               // in_hand_ is the estimator's
  std::size_t recalibration_ = kNone;  // frame before which one was asked for, and waits for it
  std::size_t next_reading_ = 0;
  Comparison found_{};
  std::uint64_t images_missing_ = 0;
};

}  // namespace vergence::app
