#include "drivers/exposure/exposure_controller.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::exposure {
namespace {

// 20 log10 2.
constexpr double kDbAStop = 6.020599913279624;
// Grey level below which the mean is noise.
constexpr double kDarkest = 1.0;

double to_stops(const ExposureOptions& o, const ExposureSetting& s) noexcept {
  return std::log2(static_cast<double>(s.exposure.ns()) / static_cast<double>(o.least.ns())) +
         s.gain_db / kDbAStop;
}

}  // namespace

ExposureSetting within(const ExposureOptions& o, const ExposureSetting& requested) noexcept {
  return {std::clamp(requested.exposure, o.least, o.most),
          std::clamp(requested.gain_db, 0.0, o.max_gain_db)};
}

ExposureController::ExposureController(const ExposureOptions& options,
                                       const ExposureSetting& start) noexcept
    : options_(options),
      setting_(within(options, start)),
      stops_(to_stops(options_, setting_)),
      since_change_(options.settle_frames) {}

double ExposureController::requested_stops(const Brightness& image) const noexcept {
  const double to_target = std::log2(options_.target / std::max(image.mean, kDarkest));
  if (image.bright < kSaturated)
    return std::min(to_target, std::log2(kSaturated / std::max(image.bright, kDarkest)));
  constexpr double kMaxOfIt = 0.5;
  return std::min(to_target,
                  image.saturated > kMaxOfIt ? -options_.down_stops : -0.5 * options_.down_stops);
}

ExposureSetting ExposureController::split(double stops) const noexcept {
  const double longest =
      std::log2(static_cast<double>(options_.most.ns()) / static_cast<double>(options_.least.ns()));
  const double exposure = std::clamp(stops, 0.0, longest);
  const auto ns = std::llround(static_cast<double>(options_.least.ns()) * std::exp2(exposure));
  return within(options_, {Duration::nanoseconds(ns), (stops - exposure) * kDbAStop});
}

std::optional<ExposureSetting> ExposureController::step(const Brightness& image) noexcept {
  if (image.samples == 0) return std::nullopt;
  if (since_change_ < options_.settle_frames) {
    ++since_change_;
    if (since_change_ < options_.settle_frames) return std::nullopt;
  }
  const double requested =
      std::clamp(requested_stops(image), -options_.down_stops, options_.up_stops);
  if (std::abs(requested) <= options_.dead_band) return std::nullopt;
  const ExposureSetting next = split(stops_ + requested);
  const double stops = to_stops(options_, next);
  // The setting is at a bound.
  if (std::abs(stops - stops_) < 0.5 * options_.dead_band) return std::nullopt;
  stops_ = stops;
  setting_ = next;
  since_change_ = 0;
  return setting_;
}

}  // namespace vergence::exposure
