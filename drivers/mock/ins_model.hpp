#pragma once
#include <cstdint>

#include <GeographicLib/LocalCartesian.hpp>

#include "core/math/random.hpp"
#include "core/types/ins_sample.hpp"
#include "drivers/mock/rig_truth.hpp"

namespace vergence::mock {

/// Origin of the simulated world: St Lucia, Brisbane.
inline constexpr Geodetic kWorldOrigin{-27.4975, 153.0137, 60.0};

struct InsModelOptions {
  bool ideal = false;
  std::uint64_t seed = 1;
  double rate_hz = 120;
};

/// INS of the MTi-G's class. Each error is a first-order Gauss–Markov process with a realistic
/// correlation time.
///
///   position  2.5 m CEP (2.12 m per axis), height 4 m, over 60 s
///   velocity  0.1 m/s per axis over 5 s
///   attitude  roll and pitch 0.5° over 30 s, heading 1° over 60 s
/// If ideal, there are no errors. Geodetic coordinates use the exact tangent plane at kWorldOrigin,
/// the attitude the local axes at the position. One caller; samples in order of their numbers.
class InsModel {
 public:
  InsModel(const InsModelOptions& options, const RigTruth& truth);

  /// Sample of this number (from 0, without gaps) at a time of the drive; stamps are not set.
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
  // Order: position east north up, velocity, roll pitch heading.
  std::array<Wander, 9> wander_;
};

}  // namespace vergence::mock
