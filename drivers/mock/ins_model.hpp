#pragma once
#include <cstdint>

#include <GeographicLib/LocalCartesian.hpp>

#include "core/math/random.hpp"
#include "core/types/ins_sample.hpp"
#include "drivers/mock/rig_truth.hpp"

namespace vergence::mock {

/// Where the mock's world lies: St Lucia, Brisbane.
inline constexpr Geodetic kWorldOrigin{-27.4975, 153.0137, 60.0};

struct InsModelOptions {
  bool ideal = false;
  std::uint64_t seed = 1;
  double rate_hz = 120;
};

/// An INS of the MTi-G's class: each error is a first-order Gauss–Markov process, as slow as the
/// real thing's.
///
///   position  2.5 m CEP (2.12 m each axis), height 4 m, wandering over 60 s
///   velocity  0.1 m/s each axis over 5 s
///   attitude  roll and pitch 0.5° over 30 s, heading 1° over 60 s
/// Ideal: no errors at all. Geodetic coordinates from the exact tangent plane at kWorldOrigin,
/// attitude in the axes at the place itself.
/// Threads  One caller; samples in order of their numbers.
class InsModel {
 public:
  InsModel(const InsModelOptions& options, const RigTruth& truth);

  /// The reading of this number (from 0, none left out) at a time of the drive; stamps are not set.
  [[nodiscard]] InsSample sample(std::uint64_t number, Duration time);

 private:
  struct Wander {
    double sigma, correlation_s, value;
  };
  void advance();

  InsModelOptions options_;
  const RigTruth& truth_;
  GeographicLib::LocalCartesian plane_;
  Random random_;
  std::array<Wander, 9> wander_;  // east north up, velocity, roll pitch heading
};

}  // namespace vergence::mock
