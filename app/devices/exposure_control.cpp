#include "app/devices/exposure_control.hpp"

#include <cmath>
#include <cstdlib>

namespace vergence::app {
namespace {

// Relative difference of exposures to which cameras round.
constexpr double kAlike = 0.02;
// Difference of gains in dB to which cameras round.
constexpr double kAlikeGain = 0.15;

bool alike(const Duration& a, const Duration& b) noexcept {
  return std::abs(static_cast<double>((a - b).ns())) <=
         kAlike * static_cast<double>(std::max(a, b).ns());
}

bool alike_gain(double a_db, double b_db) noexcept { return std::abs(a_db - b_db) <= kAlikeGain; }

bool has(const Frame& frame, const ExposureSetting& setting) noexcept {
  return alike(frame.exposure, setting.exposure) && alike_gain(frame.gain_db, setting.gain_db);
}

}  // namespace

ExposureControl::ExposureControl(std::vector<CameraDevice*> cameras, int width, int height,
                                 const ImageView& mask, const exposure::ExposureOptions& options,
                                 const ExposureSetting& start, bool at_once)
    : cameras_(std::move(cameras)),
      meter_(width, height, mask),
      options_(options),
      controller_(options, start),
      at_once_(at_once) {
  applied_.fill(start);
  if (at_once_) return;
  thread_.start(
      "vergence-expose", [] {},
      [this](const ExposureSetting* requested) {
        if (requested == nullptr) return;
        set_all(*requested);
        under_way_.store(false, std::memory_order_release);
      });
}

void ExposureControl::on_frame(std::size_t k, const Frame& frame) noexcept {
  if (unsupported_.load(std::memory_order_relaxed) || under_way_.load(std::memory_order_acquire))
    return;
  // The request is done, so images may use it from here on.
  if (asked_) {
    asked_ = false;
    controller_.restart_settling();
    frames_without_.fill(0);
  }
  if (is_without(k, frame)) {
    again_.fetch_add(1, std::memory_order_relaxed);
    ask(controller_.setting());
    return;
  }
  if (k != 0) return;
  const auto next =
      controller_.step(meter_.measure(cameras_[0]->view(frame.slot), options_.may_saturate));
  if (!next) return;
  changes_.fetch_add(1, std::memory_order_relaxed);
  ask(*next);
}

/// A camera that came back may have lost what it was given.
bool ExposureControl::is_without(std::size_t k, const Frame& frame) noexcept {
  const int patience = 4 * options_.settle_frames;
  int& n = frames_without_[k];
  n = has(frame, applied_[k]) ? 0 : n + 1;
  if (n < patience) return false;
  n = 0;
  return true;
}

void ExposureControl::ask(const ExposureSetting& requested) noexcept {
  asked_ = true;
  if (at_once_) {
    set_all(requested);
    return;
  }
  under_way_.store(true, std::memory_order_release);
  (void)thread_.post(requested);
}

void ExposureControl::set_all(const ExposureSetting& requested) noexcept {
  bool unequal = false;
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    ExposureSetting actual = requested;
    const DeviceStatus status = cameras_[k]->set_exposure(requested, &actual);
    if (status == DeviceStatus::unsupported) unsupported_.store(true);
    if (status != DeviceStatus::ok) {
      refused_.fetch_add(1, std::memory_order_relaxed);
      // One that is away comes back with what it had: its frames tell, and it is asked again.
      if (status == DeviceStatus::disconnected) applied_[k] = requested;
      continue;
    }
    applied_[k] = actual;
    unequal = unequal || !alike(actual.exposure, applied_[0].exposure) ||
              !alike_gain(actual.gain_db, applied_[0].gain_db);
  }
  if (unequal) unequal_.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace vergence::app
