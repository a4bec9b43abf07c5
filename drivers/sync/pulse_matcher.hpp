#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/sync/clock_tie.hpp"
#include "drivers/sync/missed_trigger_doubt.hpp"
#include "drivers/sync/pulse_acquisition.hpp"
#include "drivers/sync/pulse_train.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// Ties one camera's frames to numbered pulses: first by proof, then by stamp and counter together.
///
/// Acquiring  PulseAcquisition: the pulses of the first frames, by proof.
/// Limits     Where only a pause proves, a camera that misses as many triggers in a row as a pause
///            leaves out, within `latest` after one, is laid over it. A clock that is set back by
///            as many intervals as triggers are missed at that moment goes unseen until the
///            intervals differ.
/// Proven     The camera's clock is tied to the source's (ClockTie). A frame's pulse is where its
///            stamp falls on the train. The numbers are integers and are never averaged.
/// Doubt      A missed trigger and a clock that was set by as much look alike at first. From one on
///            the camera is doubtful until a later interval fits the pulses only where the trigger
///            was missed: the next that differs where intervals vary, else a pause.
/// Threads    One caller. Memory: fixed. Time: constant a call, or a trial of PulseAcquisition.
/// Errors     None: outcomes.
class PulseMatcher {
 public:
  static constexpr std::size_t kRun = PulseAcquisition::kRun;

  enum class Outcome : std::uint8_t {
    matched,
    again,  // a counter and stamp that were here before: of that number
    acquiring,
    contradicted,  // and acquiring from now on
  };
  struct Match {
    Outcome outcome = Outcome::acquiring;
    std::uint64_t number = 0;
    DeviceStamp edge{};        // of the pulse by the source's clock, as the frame's stamp has it
    Duration gate{};           // |true edge − edge| is below this
    std::uint64_t missed = 0;  // pulses since the last frame that the camera did not expose
    std::uint64_t lost = 0;    // exposures since the last frame that gave no image
    bool doubtful = false;
  };

  PulseMatcher() noexcept : PulseMatcher({}, {}, {}, 0) {}
  /// `noise`: by how much a stamp of this camera may be off the edge plus a constant. `latest`:
  /// SyncCameraOptions.
  /// `pause`: pulses that a pause leaves out; another number of them may hide a pulse whose report
  /// was lost. 0: any.
  PulseMatcher(Duration noise, Duration interval, Duration latest, std::uint64_t pause) noexcept
      : interval_(interval), acquisition_(noise, latest, pause), tie_(noise, interval) {}

  /// Frames in the order of arrival.
  [[nodiscard]] Match frame(const PulseTrain& train, std::uint64_t counter, DeviceStamp stamp,
                            HostStamp arrival) noexcept;
  /// The newest pulse of the train has just been reported. The number of a frame that it
  /// contradicts: the camera acquires from now on.
  [[nodiscard]] std::optional<std::uint64_t> report(const PulseTrain& train,
                                                    HostStamp arrival) noexcept;
  /// Forgets everything: the camera or the train began again.
  void restart() noexcept;

  [[nodiscard]] bool proven() const noexcept { return proven_; }
  /// The least number that the exposure of this counter can have. Precondition: proven().
  [[nodiscard]] std::uint64_t least_number(std::uint64_t counter) const noexcept;
  /// Frames since the last missed trigger may be of earlier pulses than they were matched with.
  [[nodiscard]] bool doubtful() const noexcept { return doubt_.any(); }
  /// Trials of the current acquisition that proved nothing, or frames that did not end the current
  /// doubt.
  [[nodiscard]] int failures() const noexcept { return failures_; }
  [[nodiscard]] std::uint64_t acquisitions() const noexcept { return acquisitions_; }
  /// From an acquisition's first frame to its proof, by arrivals.
  [[nodiscard]] Duration worst_acquisition() const noexcept { return worst_acquisition_; }

 private:
  static constexpr std::size_t kPending = 8;
  static constexpr std::size_t kRecent = 16;

  void acquire(const PulseTrain& train, HostStamp now) noexcept;
  void adopt(const PulseTrain& train, const PulseAcquisition::Trial& trial, HostStamp now) noexcept;
  [[nodiscard]] Match match(const PulseTrain& train, const StampedFrame& frame) noexcept;
  void settle(const PulseTrain& train, std::uint64_t number) noexcept;
  [[nodiscard]] Match repeated(const StampedFrame& frame) const noexcept;
  [[nodiscard]] Match contradict(const StampedFrame& frame) noexcept;

  Duration interval_;
  bool proven_ = false;
  int failures_ = 0;
  PulseAcquisition acquisition_;
  // Proven.
  ClockTie tie_;
  MissedTriggerDoubt doubt_;
  std::array<StampedFrame, kRecent> recent_{};
  std::size_t recents_ = 0;
  std::array<StampedFrame, kPending>
      pending_{};  // given a number before its pulse's report, oldest first
  std::size_t pendings_ = 0;
  StampedFrame last_{};
  std::uint64_t last_skipped_ = 0;
  Duration least_delay_{};  // from edge to arrival
  std::uint64_t acquisitions_ = 0;
  Duration worst_acquisition_{};
};

}  // namespace vergence
