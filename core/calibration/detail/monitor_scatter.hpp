#pragma once
#include <algorithm>
#include <cstdint>

#include "core/calibration/detail/monitor_evidence.hpp"

namespace vergence::calibration::detail {

/// Scatter between successive stretches of a run beyond the noise of their tracks. Residual lens
/// errors appear as an offset that depends on the position of structure in the image, and therefore
/// varies.
///
/// The scatter is a running mean of (dᵀ A d − expected by noise) / (5 n) over blocks of frames,
/// where d is a block's offset from the blocks before it. Its initial value weighs kExpectedBlocks
/// blocks. A value.
class BlockScatter {
 public:
  /// Sets the initial value, in px rms over the image.
  void expect(double bias_px) noexcept {
    expected2_ = bias_px * bias_px / kTheta;
    sum_ = 0;
    blocks_ = 0;
    used_ = true;
  }
  /// `lambda`: the inflation of both. Blocks that do not determine all directions are skipped.
  void add(const Evidence& block, const Evidence& past, double lambda) noexcept;

  /// Variance per parameter, in px²; 0 before expect().
  [[nodiscard]] double variance() const noexcept {
    if (!used_) return 0;
    return std::max(0.0, (kExpectedBlocks * expected2_ + sum_) /
                             (kExpectedBlocks + static_cast<double>(blocks_)));
  }

 private:
  static constexpr double kExpectedBlocks = 4;
  double expected2_ = 0, sum_ = 0;
  std::uint64_t blocks_ = 0;
  bool used_ = false;
};

}  // namespace vergence::calibration::detail
