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
  /// Maximum change, in stops; larger downwards, because the excess of saturated pixels is unknown.
  double up_stops = 1, down_stops = 2;
  /// Frames from a change to the next evaluated image; longer than the latency of every camera.
  int settle_frames = 5;
};

/// Controls exposure and gain of a rig by the brightness of its reference camera.
///
/// Method   In stops. An image is log2(target / mean) too dark, but the increase is limited so that
///          at most `may_saturate` of it saturates. If that share is already exceeded, the excess
///          is unknown: exposure decreases by half of `down_stops`, or by all if half of the image
///          is saturated. Gain is used only beyond the longest exposure.
/// Delay    A change takes effect after an unknown number of frames, so `settle_frames` images are
///          skipped after it. Each change is thus measured before the next, and a sensor whose
///          response is between linear and its square root does not oscillate.
///
/// Not thread-safe. Does not allocate.
class ExposureController {
 public:
  /// Clamps `start`, the cameras' present setting, to the bounds. Precondition: 0 < least ≤ most.
  ExposureController(const ExposureOptions& options, const ExposureSetting& start) noexcept;

  /// Evaluates an image of the reference camera. Returns a new setting for all cameras, or nothing
  /// if it stays.
  [[nodiscard]] std::optional<ExposureSetting> step(const Brightness& image) noexcept;
  /// Restarts the count of images, because the cameras were changed only now.
  void restart_settling() noexcept { since_change_ = 0; }
  [[nodiscard]] const ExposureSetting& setting() const noexcept { return setting_; }

 private:
  [[nodiscard]] double requested_stops(const Brightness& image) const noexcept;
  [[nodiscard]] ExposureSetting split(double stops) const noexcept;

  ExposureOptions options_;
  ExposureSetting setting_;
  // Sum of exposure and gain above the shortest exposure.
  double stops_ = 0;
  // Images since the last change.
  int since_change_;
};

/// Clamps to the bounds, exposure first.
[[nodiscard]] ExposureSetting within(const ExposureOptions& options,
                                     const ExposureSetting& requested) noexcept;

}  // namespace vergence::exposure
