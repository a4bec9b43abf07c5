#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/calibration/track_log.hpp"

namespace vergence::app {

/// A point that the left camera and camera k saw in one frame, raw pixels.
struct RawMatch {
  std::array<float, 2> left{}, other{};
  std::uint64_t frame = 0;
  std::uint8_t camera = 1;
};

/// An even sample of a drive's matches across, for a look at how a calibration fits them all over
/// the image.
///
/// Every n-th match is kept; when there is no room for more, every second one goes and n doubles: a
/// long drive is sampled thinner, from its start to its end alike. The same drive gives the same
/// sample.
/// Threads  One. Memory  Its own array: make it where there is room for 640 kB.
class MatchSample {
 public:
  static constexpr std::size_t kMost = 20'000;

  /// The newest frame of the log, if it is new.
  void take(const calibration::TrackLog& log) noexcept;
  /// From this frame on the rig is another one.
  void rig_changed(std::uint64_t frame) noexcept;

  [[nodiscard]] std::span<const RawMatch> matches() const noexcept {
    return std::span(matches_).first(size_);
  }
  /// Frames before this one saw the rig that the drive began with.
  [[nodiscard]] std::uint64_t first_change() const noexcept { return first_change_; }

 private:
  void push(const RawMatch& match) noexcept;

  std::array<RawMatch, kMost> matches_{};
  std::size_t size_ = 0;
  std::uint64_t seen_ = 0, step_ = 1;
  std::uint64_t newest_ = 0;  // frame taken last
  bool any_ = false;
  std::uint64_t first_change_ = std::numeric_limits<std::uint64_t>::max();
};

}  // namespace vergence::app
