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

/// Frame with its camera's data and its pulse.
struct StampedFrame {
  std::uint64_t counter = 0;
  DeviceStamp stamp{};
  HostStamp arrival{};
  /// Number of the pulse, once matched.
  std::uint64_t number = 0;
};

/// Difference of a camera's counter between two frames; negative if it ran back.
[[nodiscard]] constexpr std::int64_t advance(std::uint64_t from, std::uint64_t to) noexcept {
  return static_cast<std::int64_t>(to - from);
}

/// Finds the pulses of a camera's first frames and verifies the association.
///
/// Method     Compares the camera's last kRun stamps with the train at every place. Their intervals
///            must equal those of the pulses within the noise, and the counter must advance as the
///            pulses do. A place is verified if it alone fits, and no other fits within twice the
///            noise with kOdd oddities (a missed trigger, a pulse during a pause). For this
///            exclusion, unreported pulses count as fitting and pulses before the first report as
///            possible. A run is tried only if its last frame arrived before the newest pulse, so
///            that the true place is among the candidates; for the same reason none is verified
///            next to a missing report. Pulses at even intervals fit everywhere, so they verify
///            only across a pause.
/// Cost       Not thread-safe. Fixed memory. A trial takes at most kHeld · kRun steps.
/// Errors     None: an acquisition without a result continues.
///
///     acquisition.add(frame);
///     if (const auto trial = acquisition.attempt(train); trial && trial->verified) use(*trial);
class PulseAcquisition {
 public:
  /// Number of frames: a wrong place fits all fourteen dithered intervals once in 16000 cases.
  static constexpr std::size_t kRun = 15;
  /// Room for a run and for the frames that arrive before its pulses are reported.
  static constexpr std::size_t kFrames = 32;
  /// Oddities granted; a pause that is misplaced by one needs two.
  static constexpr std::uint64_t kOdd = 1;
  /// Places next to the found one that must be excluded.
  static constexpr std::size_t kNear = 8;

  struct Trial {
    bool verified = false;
    /// Place of the run's last frame on the train.
    std::size_t place = 0;
    /// Index in frames() after the run's last frame.
    std::size_t end = 0;
  };

  /// Parameters as in PulseMatcher.
  PulseAcquisition(Duration noise, Duration latest, std::uint64_t pause) noexcept
      : noise_(noise), latest_(latest), pause_(pause) {}

  void clear() noexcept;
  /// Adds a frame, in order of arrival; a repeated one is ignored.
  void add(const StampedFrame& frame) noexcept;
  /// Tries the newest run that can be tried, once; none if there is no new one.
  [[nodiscard]] std::optional<Trial> attempt(const PulseTrain& train) noexcept;

  /// Frames, oldest first.
  [[nodiscard]] std::span<const StampedFrame> frames() const noexcept {
    return std::span(frames_).first(count_);
  }
  /// Arrival of the first frame since clear(). Precondition: there is one.
  [[nodiscard]] HostStamp began() const noexcept { return began_; }

 private:
  // A `beyond` run fits as far back as the train reaches.
  enum class Fit : std::uint8_t { none, loose, strict, beyond };

  [[nodiscard]] Fit fit(const PulseTrain& train, std::size_t place, std::size_t end) const noexcept;
  [[nodiscard]] bool believable(const PulseTrain& train, std::size_t place,
                                std::size_t end) const noexcept;

  Duration noise_, latest_;
  std::uint64_t pause_;
  // Oldest first.
  std::array<StampedFrame, kFrames> frames_{};
  std::size_t count_ = 0;
  // Number of frames up to the end of the last tried run.
  std::size_t tried_ = 0;
  HostStamp began_{};
  bool begun_ = false;
};

/// Distinguishes missed triggers from a clock that was set by as much, which look alike at first.
///
/// If the clock was set instead of s triggers missed, the stamps now follow the pulse s earlier at
/// a constant offset. This is refuted once that offset has changed by more than the limit. Dithered
/// intervals decide soon, even ones only at a pause. Not thread-safe. Fixed memory. At most kMax
/// steps per call.
class MissedTriggerTest {
 public:
  /// Maximum number of pulses missed while undecided.
  static constexpr std::size_t kMax = 8;

  void clear() noexcept { pulses_ = 0; }
  [[nodiscard]] bool any() const noexcept { return pulses_ > 0; }
  /// Adds further missed triggers. Returns false if they exceed kMax in total.
  [[nodiscard]] bool add(std::uint64_t missed) noexcept;
  /// Compares a frame that fits this reported pulse. Returns true once it is certain that triggers
  /// were missed.
  [[nodiscard]] bool compare(const PulseTrain& train, std::uint64_t number,
                             Duration limit) noexcept;

 private:
  /// Hypothesis that a frame belongs to the pulse s earlier.
  struct Rival {
    // Range of the observed time to that pulse.
    Duration least{}, greatest{};
    bool compared = false, refuted = false;
  };

  // Number of pulses by which the frames may be wrong; 0 if none.
  std::uint64_t pulses_ = 0;
  std::array<Rival, kMax> rivals_{};
};

/// Associates one camera's frames with numbered pulses: first by verification, then by stamp and
/// counter.
///
/// Acquiring  PulseAcquisition verifies the pulses of the first frames.
/// Verified   The ClockTie maps the camera's stamps to the train, which gives a frame's pulse.
///            Numbers are integers and are never averaged.
/// Suspect    A missed trigger and a clock set by as much look alike at first. The camera is
///            suspect until a later interval excludes the second: the next different one with
///            dither, else a pause.
/// Limits     If only a pause verifies, a camera that misses as many triggers in a row as a pause
///            omits, within `latest` after one, is associated wrongly. A clock set back by as many
///            intervals as triggers are missed at that moment is undetected until the intervals
///            differ.
/// Cost       Not thread-safe. Fixed memory. Constant time per call, except for a trial of
///            PulseAcquisition.
class PulseMatcher {
 public:
  static constexpr std::size_t kRun = PulseAcquisition::kRun;

  enum class Outcome : std::uint8_t {
    matched,
    /// Counter and stamp of an earlier frame, whose number is returned.
    again,
    acquiring,
    /// The association was wrong; the camera acquires again.
    contradicted,
  };
  struct Match {
    Outcome outcome = Outcome::acquiring;
    std::uint64_t number = 0;
    /// Edge of the pulse on the source's clock, according to the frame's stamp.
    DeviceStamp edge{};
    /// Upper bound of
    /// true edge − edge
    /// .
    Duration gate{};
    /// Pulses since the last frame that the camera did not expose.
    std::uint64_t missed = 0;
    /// Exposures since the last frame without an image.
    std::uint64_t lost = 0;
    bool suspect = false;
  };

  PulseMatcher() noexcept : PulseMatcher({}, {}, {}, 0) {}
  /// `noise` bounds the deviation of this camera's stamps from the edge plus a constant. `latest`
  /// as in SyncCameraOptions. `pause` is the number of pulses that a pause omits (0: any); another
  /// number may hide a pulse whose report was lost.
  PulseMatcher(Duration noise, Duration interval, Duration latest, std::uint64_t pause) noexcept
      : interval_(interval), acquisition_(noise, latest, pause), tie_(noise, interval) {}

  /// Matches a frame; frames must be in order of arrival.
  [[nodiscard]] Match frame(const PulseTrain& train, std::uint64_t counter, DeviceStamp stamp,
                            HostStamp arrival) noexcept;
  /// Called when the newest pulse of the train was reported. Returns the number of a frame that it
  /// contradicts; the camera then acquires again.
  [[nodiscard]] std::optional<std::uint64_t> report(const PulseTrain& train,
                                                    HostStamp arrival) noexcept;
  /// Forgets everything, because the camera or the train restarted.
  void restart() noexcept;

  [[nodiscard]] bool verified() const noexcept { return verified_; }
  /// Smallest possible number of the exposure with this counter. Precondition: verified().
  [[nodiscard]] std::uint64_t min_number(std::uint64_t counter) const noexcept;
  /// True if frames since the last missed trigger may belong to earlier pulses than matched.
  [[nodiscard]] bool suspect() const noexcept { return missed_trigger_.any(); }
  /// Unsuccessful trials of the current acquisition, or frames for which the camera has been
  /// suspect.
  [[nodiscard]] int failures() const noexcept { return failures_; }
  [[nodiscard]] std::uint64_t acquisitions() const noexcept { return acquisitions_; }
  /// Longest time from the first frame of an acquisition to its verification, by arrivals.
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
  // State while verified.
  ClockTie tie_;
  MissedTriggerTest missed_trigger_;
  std::array<StampedFrame, kRecent> recent_{};
  std::size_t recents_ = 0;
  // Frames numbered before their pulse's report, oldest first.
  std::array<StampedFrame, kPending> pending_{};
  std::size_t pendings_ = 0;
  StampedFrame last_{};
  std::uint64_t last_skipped_ = 0;
  // Delay from edge to arrival.
  Duration min_delay_{};
  std::uint64_t acquisitions_ = 0;
  Duration worst_acquisition_{};
};

}  // namespace vergence
