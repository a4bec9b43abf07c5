#pragma once
#include <cstdint>

#include "drivers/mock/detail/pulse_plan.hpp"
#include "drivers/mock/rig_truth.hpp"

namespace vergence::mock {

/// One pulse as a camera's input meets it.
struct PulseAt {
  std::uint64_t number = 0;  // its slot in the plan
  Duration time{};           // of the exposure's start, since the drive's start
  const PulsePlan* plan = nullptr;
};

/// What becomes of one camera's image of one pulse, by the faults that are due.
struct Exposure {
  bool missed = false;  // never happens
  bool lost = false;    // never arrives
  bool twice = false;   // arrives again
  Duration delay{};     // of the arrival, beyond the usual
  double brightness = 1;
  // Which image it is: usually this camera's, of this pulse.
  int camera = 0;
  std::uint64_t pulse = 0;  // numbers its noise
  Duration time{};          // of the start of the exposure
};

/// Pure function of its arguments; the draws of faults with a share come from `seed`.
[[nodiscard]] Exposure exposure_of(const RigTruth& truth, std::uint64_t seed, const PulseAt& pulse,
                                   int camera) noexcept;

}  // namespace vergence::mock
