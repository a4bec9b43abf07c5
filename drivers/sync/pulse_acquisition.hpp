#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/sync/pulse_train.hpp"

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
///     if (const auto trial = acquisition.attempt(train); trial && trial->proven) use(*trial);
class PulseAcquisition {
 public:
  static constexpr std::size_t kRun =
      15;  // frames: a wrong place fits all fourteen varied intervals once in 16000
  static constexpr std::size_t kFrames =
      32;  // a run, and those that came while its pulses were still to be reported
  static constexpr std::uint64_t kOdd = 1;  // a pause laid one place off takes two
  static constexpr std::size_t kNear = 8;   // places beside the found one that must be excluded

  struct Trial {
    bool proven = false;
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

}  // namespace vergence
