#pragma once
#include <optional>

#include "drivers/camera.hpp"
#include "drivers/exposure/brightness.hpp"

namespace vergence::exposure {

struct ExposureOptions {
  /// Target mean grey level.
  double target = 90;
  /// Permitted share of saturated pixels.
  double may_saturate = 0.05;
  /// Half width, in stops (factors of two), of the band in which the exposure is kept.
  double dead_band = 0.2;
  /// Shortest exposure.
  Duration least = Duration::microseconds(20);
  /// Longest exposure, limited by motion blur.
  Duration most = Duration::microseconds(8000);
  /// Used once the exposure is at its longest.
  double max_gain_db = 18;
  double up_stops = 1,
         down_stops = 2;  // a change at most; down is faster: saturated pixels tell nothing
  /// Frames from a change to the next evaluated image; longer than the latency of every camera.
  int settle_frames = 5;
};

/// Exposure and gain of a rig, from the brightness of its reference camera.
///
/// Method   In stops. An image is log2(target / mean) too dark, but never asked so far up that more
///          than `may_saturate` of it would saturate; where that share is saturated already, how
///          far is unknown, and it goes down by half of `down_stops`, by all of it where half of
///          the picture is. The sum of exposure and gain moves by that, exposure first, gain beyond
///          its longest.
/// Delay    A change shows after an unknown number of frames: until `settle_frames` images
///          have been seen since, none is judged. So each change is measured before the next is
///          made, and a sensor whose response is between linear and its square root does not swing.
/// Not thread-safe. Does not allocate.
class ExposureController {
 public:
  /// Precondition: 0 < least ≤ most. `start`: what the cameras have, brought inside the bounds.
  ExposureController(const ExposureOptions& options, const ExposureSetting& start) noexcept;

  /// One image of the reference camera. → what all cameras are to have from now on; nothing: as it
  /// is.
  [[nodiscard]] std::optional<ExposureSetting> step(const Brightness& image) noexcept;
  /// The cameras were asked only now: images are counted from here on.
  void restart_settling() noexcept { since_change_ = 0; }
  [[nodiscard]] const ExposureSetting& setting() const noexcept { return setting_; }

 private:
  [[nodiscard]] double requested_stops(const Brightness& image) const noexcept;
  [[nodiscard]] ExposureSetting split(double stops) const noexcept;

  ExposureOptions options_;
  ExposureSetting setting_;
  double stops_ = 0;  // above the shortest exposure without gain
  int since_change_;  // images
};

/// Brought inside the bounds: exposure first.
[[nodiscard]] ExposureSetting within(const ExposureOptions& options,
                                     const ExposureSetting& requested) noexcept;

}  // namespace vergence::exposure
