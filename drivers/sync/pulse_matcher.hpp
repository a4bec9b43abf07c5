#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/sync/clock_tie.hpp"
#include "drivers/sync/pulse_train.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// A frame as its camera and its driver describe it, and the pulse that it was matched with.
struct StampedFrame {
  std::uint64_t counter = 0;
  DeviceStamp stamp{};
  HostStamp arrival{};
  std::uint64_t number = 0;  // of the pulse, once matched
};

/// Counts that a camera advanced between two frames; negative: it ran back.
[[nodiscard]] constexpr std::int64_t advance(std::uint64_t from, std::uint64_t to) noexcept {
  return static_cast<std::int64_t>(to - from);
}

/// Finds the pulses of a camera's first frames, by proof.
///
/// Method     The camera's last kRun stamps are laid over the train at every place. An interval of
///            theirs must be one of the pulses' within the noise of the stamps, and the counter
///            must advance as the pulses do. Proven: exactly one place fits so, and no other fits
///            within twice the noise with kOdd oddities granted (a missed trigger; a pulse that
///            went out in a pause), unreported pulses taken as fitting and those before the first
///            report as possible. Only runs whose last frame had arrived when the newest pulse went
///            out are tried, so that the true place is among them; for the same reason none is
///            found beside a report that is missing. Pulses at even intervals fit everywhere and
///            prove nothing, until one of them is a pause.
/// Threads    One caller. Memory: fixed. Time: a trial at most kHeld · kRun steps.
/// Errors     None: an acquisition that proves nothing goes on.
///
///     acquisition.add(frame);
///     if (const auto trial = acquisition.attempt(train); trial && trial->verified) use(*trial);
class PulseAcquisition {
 public:
  static constexpr std::size_t kRun =
      15;  // frames: a wrong place fits all fourteen varied intervals once in 16000
  static constexpr std::size_t kFrames =
      32;  // a run, and those that came while its pulses were still to be reported
  static constexpr std::uint64_t kOdd = 1;  // a pause laid one place off takes two
  static constexpr std::size_t kNear = 8;   // places beside the found one that must be excluded

  struct Trial {
    bool verified = false;
    std::size_t place = 0;  // on the train, of the run's last frame
    std::size_t end = 0;    // the run ends before this one of frames()
  };

  /// As PulseMatcher's.
  PulseAcquisition(Duration noise, Duration latest, std::uint64_t pause) noexcept
      : noise_(noise), latest_(latest), pause_(pause) {}

  void clear() noexcept;
  /// Frames in the order of arrival; one that came before is passed over.
  void add(const StampedFrame& frame) noexcept;
  /// The newest run that can be tried, once: none where there is no new one.
  [[nodiscard]] std::optional<Trial> attempt(const PulseTrain& train) noexcept;

  /// Oldest first.
  [[nodiscard]] std::span<const StampedFrame> frames() const noexcept {
    return std::span(frames_).first(count_);
  }
  /// Arrival of the first frame since clear(). Precondition: there was one.
  [[nodiscard]] HostStamp began() const noexcept { return began_; }

 private:
  enum class Fit : std::uint8_t {
    none,
    loose,
    strict,
    beyond
  };  // beyond: fits as far as the train reaches back

  [[nodiscard]] Fit fit(const PulseTrain& train, std::size_t place, std::size_t end) const noexcept;
  [[nodiscard]] bool believable(const PulseTrain& train, std::size_t place,
                                std::size_t end) const noexcept;

  Duration noise_, latest_;
  std::uint64_t pause_;
  std::array<StampedFrame, kFrames> frames_{};  // oldest first
  std::size_t count_ = 0;
  std::size_t tried_ = 0;  // frames of these that a trial has ended with
  HostStamp began_{};
  bool begun_ = false;
};

/// Distinguishes missed triggers from a clock that was set by as much: both look alike at first.
///
/// Method   Had the clock been set instead of s triggers missed, the stamps would now follow the
///          pulse s earlier, a constant time off. That is refuted once this time has changed by
///          more than the limit given. Intervals that differ settle it soon, even ones not before a
///          pause.
/// Threads  One caller. Memory: fixed. Time: at most kMax steps a call.
class MissedTriggerTest {
 public:
  static constexpr std::size_t kMax = 8;  // pulses missed since the doubt began

  void clear() noexcept { pulses_ = 0; }
  [[nodiscard]] bool any() const noexcept { return pulses_ > 0; }
  /// So many more triggers seem to have been missed. False: more than kMax.
  [[nodiscard]] bool add(std::uint64_t missed) noexcept;
  /// A frame of this reported pulse fits it. True: the triggers were missed, the doubt is over.
  [[nodiscard]] bool compare(const PulseTrain& train, std::uint64_t number,
                             Duration limit) noexcept;

 private:
  /// The pulse s before the frame's.
  struct Rival {
    Duration least{}, greatest{};  // time to it, seen in doubt
    bool compared = false, refuted = false;
  };

  std::uint64_t pulses_ = 0;  // by which the frames may be off; 0: none
  std::array<Rival, kMax> rivals_{};
};

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
    bool suspect = false;
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

  [[nodiscard]] bool verified() const noexcept { return verified_; }
  /// The least number that the exposure of this counter can have. Precondition: verified().
  [[nodiscard]] std::uint64_t min_number(std::uint64_t counter) const noexcept;
  /// Frames since the last missed trigger may be of earlier pulses than they were matched with.
  [[nodiscard]] bool suspect() const noexcept { return missed_trigger_.any(); }
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
  bool verified_ = false;
  int failures_ = 0;
  PulseAcquisition acquisition_;
  // Proven.
  ClockTie tie_;
  MissedTriggerTest missed_trigger_;
  std::array<StampedFrame, kRecent> recent_{};
  std::size_t recents_ = 0;
  std::array<StampedFrame, kPending>
      pending_{};  // given a number before its pulse's report, oldest first
  std::size_t pendings_ = 0;
  StampedFrame last_{};
  std::uint64_t last_skipped_ = 0;
  Duration min_delay_{};  // from edge to arrival
  std::uint64_t acquisitions_ = 0;
  Duration worst_acquisition_{};
};

}  // namespace vergence
