#pragma once
#include <algorithm>
#include <cstdint>

#include "core/calibration/detail/monitor_evidence.hpp"

namespace vergence::calibration::detail {

/// Scatter between successive stretches of a drive beyond the noise of their tracks. Residual lens
/// errors appear as an offset that depends on where the structure is in the image, and so differs
/// from stretch to stretch.
///
/// A running mean of (dᵀ A d − expected by noise) / (5 n) over blocks of frames, d a block's own
/// offset from the blocks before it; begins with an expectation that weighs some blocks. A value.
class BlockScatter {
 public:
  /// Before anything was measured: px rms over the image.
  void expect(double bias_px) noexcept {
    expected2_ = bias_px * bias_px / kTheta;
    sum_ = 0;
    blocks_ = 0;
    used_ = true;
  }
  /// `lambda`: the inflation of both. Blocks that see next to nothing of some direction say
  /// nothing.
  void add(const Evidence& block, const Evidence& past, double lambda) noexcept;

  /// px² of a mode; 0 where nothing was ever expected.
  [[nodiscard]] double variance() const noexcept {
    if (!used_) return 0;
    return std::max(0.0, (kExpectedBlocks * expected2_ + sum_) /
                             (kExpectedBlocks + static_cast<double>(blocks_)));
  }

 private:
  static constexpr double kExpectedBlocks = 4;  // that the expectation weighs
  double expected2_ = 0, sum_ = 0;
  std::uint64_t blocks_ = 0;
  bool used_ = false;
};

}  // namespace vergence::calibration::detail
