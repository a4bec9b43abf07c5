#include "app/session/records.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>

namespace vergence::app {
namespace {

/// The words of events.jsonl, in the order of EstimatorEvent::Kind.
const char* kind_word(EstimatorEvent::Kind kind) noexcept {
  switch (kind) {
    case EstimatorEvent::Kind::state:
      return "state";
    case EstimatorEvent::Kind::scene_restarted:
      return "scene_restarted";
    case EstimatorEvent::Kind::time_gap:
      return "time_gap";
    case EstimatorEvent::Kind::relocalised:
      return "relocalised";
    case EstimatorEvent::Kind::dropped:
      return "dropped";
    case EstimatorEvent::Kind::rig_changed:
      return "rig_changed";
    case EstimatorEvent::Kind::in_step:
      return "in_step";
    case EstimatorEvent::Kind::calibration_confirmed:
      return "calibration_confirmed";
    case EstimatorEvent::Kind::calibration_contradicted:
      return "calibration_contradicted";
    case EstimatorEvent::Kind::focal_length_contradicted:
      return "focal_length_contradicted";
    case EstimatorEvent::Kind::calibration_accepted:
      return "calibration_accepted";
    case EstimatorEvent::Kind::calibration_rejected:
      return "calibration_rejected";
    case EstimatorEvent::Kind::calibration_waits:
      return "calibration_waits";
    case EstimatorEvent::Kind::calibration_resumed:
      return "calibration_resumed";
  }
  return "";
}

/// What stands before the reason that the estimator gives.
const char* opening(EstimatorEvent::Kind kind) noexcept {
  switch (kind) {
    case EstimatorEvent::Kind::calibration_accepted:
      return "a new calibration is in use";
    case EstimatorEvent::Kind::calibration_rejected:
      return "a calibration was rejected";
    case EstimatorEvent::Kind::calibration_waits:
      return "the calibration waits";
    case EstimatorEvent::Kind::calibration_resumed:
      return "the last calibration is in use again";
    default:
      return "";
  }
}

/// As much of the text as fits, in whole UTF-8 characters, with a 0 behind it.
template <std::size_t N>
void copy_text(std::string_view text, std::array<char, N>* out) noexcept {
  std::size_t n = std::min(text.size(), N - 1);
  if (n < text.size())
    while (n > 0 && (static_cast<unsigned char>(text[n]) & 0xc0U) == 0x80U) --n;
  std::copy_n(text.begin(), n, out->begin());
  (*out)[n] = 0;
}

}  // namespace

FrameReport FrameReport::of(const PoseSample& sample, float decode_ms,
                            const std::optional<Transform>& T_reference_left) noexcept {
  FrameReport r;
  r.pose = sample;
  r.decode_ms = decode_ms;
  r.T_reference_left = T_reference_left;
  return r;
}

FrameReport FrameReport::of(const ComparedPose& pose, float decode_ms) noexcept {
  return {pose, decode_ms,
          pose.ins_valid ? std::optional(pose.reference.T_enu_left) : std::nullopt};
}

std::array<double, 4> FrameReport::error() const noexcept {
  // A compass counts clockwise, a yaw the other way.
  return {error_enu.x(), error_enu.y(), error_enu.z(), -error_yaw * (180.0 / std::numbers::pi)};
}

void EventRecord::set_sentence(std::string_view text) noexcept { copy_text(text, &sentence); }

EventRecord EventRecord::of(const EstimatorEvent& event) noexcept {
  EventRecord r;
  r.stamp = event.stamp;
  r.kind = kind_word(event.kind);
  const bool state = event.kind == EstimatorEvent::Kind::state;
  if (state) {
    std::array<char, 256> text{};
    const auto from = to_string(event.from), to = to_string(event.to);
    (void)std::snprintf(text.data(), text.size(), "%.*s to %.*s: %s", static_cast<int>(from.size()),
                        from.data(), static_cast<int>(to.size()), to.data(), event.why);
    r.set_sentence(text.data());
    // The words are string literals: views of them end with 0.
    r.fields[0] = {"from", from.data()};
    r.fields[1] = {"to", to.data()};
  } else {
    const char* begin = opening(event.kind);
    const char* why = event.kind == EstimatorEvent::Kind::calibration_accepted ? "" : event.why;
    std::array<char, 256> text{};
    if (event.kind == EstimatorEvent::Kind::calibration_contradicted && event.value > 0)
      (void)std::snprintf(text.data(), text.size(), "%s: its depths are off by %.1f %%", why,
                          event.value);
    else if (event.kind == EstimatorEvent::Kind::focal_length_contradicted)
      (void)std::snprintf(text.data(), text.size(), "%s: the drive measures %.0f px", why,
                          event.value);
    else
      (void)std::snprintf(text.data(), text.size(), "%s%s%s", begin,
                          *begin != 0 && *why != 0 ? ": " : "", why);
    r.set_sentence(text.data());
    r.fields[0] = {"value", event.value};
  }
  return r;
}

CalibrationRecord CalibrationRecord::begin(const RigCalibration& rig, Stamp stamp,
                                           const char* cause, std::string_view origin) noexcept {
  CalibrationRecord r;
  r.stamp = stamp;
  r.accepted = true;
  r.calibration = rig;
  r.decided = false;
  r.began_as = cause;
  copy_text(origin, &r.origin);
  return r;
}

}  // namespace vergence::app
