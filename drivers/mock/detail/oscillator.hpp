#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/math/random.hpp"
#include "drivers/device.hpp"
#include "drivers/mock/faults.hpp"

namespace vergence::mock {

/// Mixes seeds, so that those differing in low bits give independent streams.
/// Finaliser of SplitMix64.
[[nodiscard]] inline std::uint64_t mixed(std::uint64_t a, std::uint64_t b) noexcept {
  std::uint64_t z = a + 0x9e3779b97f4a7c15U * (b + 1);
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

/// Clock of a device: the host's time with offset and drift, in whole microseconds; faults may set
/// it.
struct DeviceOscillator {
  /// In ns.
  std::int64_t offset = 0;
  double drift = 0;
  /// Device as in Fault::camera.
  int owner = -1;

  /// Each device has its own drift of up to ±`drift_ppm`.
  [[nodiscard]] static DeviceOscillator of(std::uint64_t seed, int owner,
                                           double drift_ppm) noexcept {
    Random random(mixed(seed, static_cast<std::uint64_t>(owner) + 10));
    const std::int64_t offset = std::llround(random.uniform(1e9, 1e12));
    return {offset, drift_ppm * 1e-6 * random.uniform(-1, 1), owner};
  }

  [[nodiscard]] DeviceStamp read(HostStamp host, Duration timing_monitor,
                                 const std::vector<Fault>& faults) const noexcept {
    std::int64_t ns = host.ns() + offset + std::llround(drift * static_cast<double>(host.ns()));
    for (const Fault& f : faults)
      if (f.kind == FaultKind::time_jump && f.camera == owner && timing_monitor >= f.at)
        ns += std::llround(f.jump * 1e9);
    return DeviceStamp(ns / 1000 * 1000);
  }
};

}  // namespace vergence::mock
