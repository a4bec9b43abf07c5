#include "drivers/mock/detail/exposure.hpp"

#include "drivers/mock/detail/oscillator.hpp"

namespace vergence::mock {
namespace {

/// The image that is delivered instead of this camera's own of this pulse.
void choose_image(const RigTruth& truth, const PulseAt& pulse, Exposure* e) noexcept {
  bool late = false;
  for (const Fault& f : truth.faults()) {
    if (!f.active(pulse.time)) continue;
    if (f.kind == FaultKind::lag && f.concerns(e->camera)) late = true;
    if (f.kind == FaultKind::swap_cables && e->camera < 2) e->camera = 1 - e->camera;
  }
  if (!late) return;
  const std::uint64_t i = pulse.number;
  e->time = pulse.time -
            (i == 0 ? pulse.plan->period() : pulse.plan->at(i).time - pulse.plan->at(i - 1).time);
  e->pulse = pulse.number - 1;
}

}  // namespace

Exposure exposure_of(const RigTruth& truth, std::uint64_t seed, const PulseAt& pulse,
                     int camera) noexcept {
  constexpr std::uint64_t kEveryCamera =
      77;  // stream of the draws that are one for the whole pulse
  Exposure e;
  e.camera = camera;
  e.pulse = pulse.number;
  e.time = pulse.time;
  choose_image(truth, pulse, &e);
  std::uint64_t number = 0;
  for (const Fault& f : truth.faults()) {
    ++number;
    // What happens to the light concerns the camera and the instant that the image is of; the rest,
    // the one that sends it and when.
    const bool light =
        f.kind == FaultKind::cover || f.kind == FaultKind::night || f.kind == FaultKind::exposure;
    if (light && f.active(e.time) && f.concerns(e.camera)) e.brightness *= f.factor;
    if (light || !f.active(pulse.time) || !f.concerns(camera)) continue;
    const std::uint64_t of_pulse = mixed(mixed(seed, pulse.number), number);
    Random random(of_pulse, static_cast<std::uint64_t>(camera));
    const bool drawn = random.uniform() < f.share;
    if (f.kind == FaultKind::lose_frames && drawn) e.lost = true;
    if (f.kind == FaultKind::late_frames && drawn) e.delay = e.delay + Duration::seconds(f.delay);
    if (f.kind == FaultKind::duplicate_frames && drawn) e.twice = true;
    if (f.kind == FaultKind::missed_trigger &&
        pulse.number < pulse.plan->first_from(f.at) + static_cast<std::uint64_t>(f.pulses))
      e.missed = true;
    if (f.kind == FaultKind::break_pairs) {
      Random together(of_pulse, kEveryCamera);
      const bool broken = together.uniform() < f.share;
      if (broken && static_cast<int>(together.below(
                        static_cast<std::uint32_t>(truth.mounted().cameras))) == camera)
        e.lost = true;
    }
  }
  return e;
}

}  // namespace vergence::mock
