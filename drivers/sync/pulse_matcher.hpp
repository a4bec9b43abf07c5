#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/sync/pulse_train.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// Ties one camera's frames to numbered pulses: first by proof, then by stamp and counter together.
///
/// Acquiring  The camera's last kRun stamps are laid over the train at every place. An interval of
///            theirs must be one of the pulses' within the noise of the stamps, and the counter
///            must advance as the pulses do. Proven: exactly one place fits so, and no other fits
///            within twice the noise with kOdd oddities granted (a missed trigger; a pulse that
///            went out in a pause), unreported pulses taken as fitting and those before the first
///            report as possible. Only runs whose last frame had arrived when the newest pulse went
///            out are tried, so that the true place is among them; for the same reason none is
///            found beside a report that is missing. Pulses at even intervals fit everywhere and
///            prove nothing, until one of them is a pause.
/// Limits     Where only a pause proves, a camera that misses as many triggers in a row as a pause
///            leaves out, within `latest` after one, is laid over it. A clock that is set back by
///            as many intervals as triggers are missed at that moment goes unseen until the
///            intervals differ.
/// Proven     The camera's clock is tied to the source's: line over the matched pairs, expanding
///            memory up to kMemory (g-h filter with the gains of the least-squares line: g =
///            2(2n−1)/(n(n+1)), h = 6/(n(n+1))). A frame's pulse is where its stamp falls on the
///            train. The numbers are integers and are never averaged.
/// Doubt      A missed trigger and a clock that was set by as much look alike at first. From one on
///            the camera is doubtful until a later interval fits the pulses only where the trigger
///            was missed: the next that differs where intervals vary, else a pause.
/// Threads    One caller. Memory: fixed. Time: constant a call; a trial at most kHeld · kRun steps.
/// Errors     None: outcomes.
class PulseMatcher {
 public:
  static constexpr std::size_t kRun =
      15;  // frames: a wrong place fits all fourteen varied intervals once in 16000
  static constexpr std::uint64_t kOdd = 1;  // a pause laid one place off takes two
  static constexpr std::size_t kNear = 8;   // places beside the found one that must be excluded

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

  PulseMatcher() noexcept = default;
  /// `noise`: by how much a stamp of this camera may be off the edge plus a constant. `latest`:
  /// SyncCameraOptions.
  /// `pause`: pulses that a pause leaves out; another number of them may hide a pulse whose report
  /// was lost. 0: any.
  PulseMatcher(Duration noise, Duration interval, Duration latest, std::uint64_t pause) noexcept
      : noise_(noise), interval_(interval), latest_(latest), pause_(pause) {}

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
  [[nodiscard]] bool doubtful() const noexcept { return doubt_ > 0; }
  /// Trials of the current acquisition that proved nothing, or frames that did not end the current
  /// doubt.
  [[nodiscard]] int failures() const noexcept { return failures_; }
  [[nodiscard]] std::uint64_t acquisitions() const noexcept { return acquisitions_; }
  /// From an acquisition's first frame to its proof, by arrivals.
  [[nodiscard]] Duration worst_acquisition() const noexcept { return worst_acquisition_; }

 private:
  static constexpr std::size_t kFrames =
      32;  // a run, and those that came while its pulses were still to be reported
  static constexpr std::size_t kPending = 8;
  static constexpr std::size_t kRecent = 16;
  static constexpr std::size_t kDoubted = 8;  // pulses missed since the doubt began
  static constexpr int kMemory = 128;         // pairs: 4 s at 30 Hz
  static constexpr double kDrift = 400e-6;    // between two crystals of 200 ppm

  struct Seen {
    std::uint64_t counter = 0;
    DeviceStamp stamp{};
    HostStamp arrival{};
    std::uint64_t number = 0;  // once matched
  };
  enum class Fit : std::uint8_t {
    none,
    loose,
    strict,
    beyond
  };  // beyond: fits as far as the train reaches back

  void remember(const Seen& seen) noexcept;
  void acquire(const PulseTrain& train, HostStamp now) noexcept;
  [[nodiscard]] Fit fit(const PulseTrain& train, std::size_t place, std::size_t end) const noexcept;
  [[nodiscard]] bool believable(const PulseTrain& train, std::size_t place,
                                std::size_t end) const noexcept;
  void adopt(const PulseTrain& train, std::size_t place, std::size_t end, HostStamp now) noexcept;
  [[nodiscard]] Match match(const PulseTrain& train, const Seen& seen) noexcept;
  void settle(const PulseTrain& train, std::uint64_t number) noexcept;
  [[nodiscard]] Match repeated(const Seen& seen) const noexcept;
  [[nodiscard]] Match contradict(const Seen& seen) noexcept;
  [[nodiscard]] DeviceStamp edge_of(DeviceStamp stamp) const noexcept;
  [[nodiscard]] Duration gate(DeviceStamp stamp) const noexcept;
  void tie(DeviceStamp stamp, DeviceStamp edge) noexcept;

  Duration noise_{}, interval_{}, latest_{};
  std::uint64_t pause_ = 0;
  bool proven_ = false;
  // Acquiring.
  std::array<Seen, kFrames> frames_{};  // oldest first
  std::size_t count_ = 0;
  std::size_t tried_ = 0;  // frames of these that a trial has ended with
  HostStamp began_{};
  bool begun_ = false;
  int failures_ = 0;
  // Proven.
  std::array<Seen, kRecent> recent_{};
  std::size_t recents_ = 0;
  std::array<Seen, kPending> pending_{};  // given a number before its pulse's report, oldest first
  std::size_t pendings_ = 0;
  Seen last_{};
  std::uint64_t last_skipped_ = 0;
  Duration least_delay_{};  // from edge to arrival
  DeviceStamp tie_stamp_{}, tie_edge_{};
  double rate_ = 0;  // of the source's clock over the camera's, minus 1
  int pairs_ = 0;
  std::uint64_t doubt_ = 0;  // pulses by which the frames may be off; 0: none
  std::array<std::array<Duration, 2>, kDoubted>
      apart_{};  // by pulses off, less one: least and greatest time to that pulse, seen in doubt
  std::array<bool, kDoubted> refuted_{}, compared_{};
  std::uint64_t acquisitions_ = 0;
  Duration worst_acquisition_{};
};

}  // namespace vergence
