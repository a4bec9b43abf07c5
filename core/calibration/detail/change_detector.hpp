#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "core/calibration/detail/monitor_residuals.hpp"

namespace vergence::calibration::detail {

/// Evidence of past moving frames: recent ones individually, older ones summed in blocks. When it
/// is full, the oldest block is dropped. A value of about 50 kB.
class EvidenceHistory {
 public:
  /// Number of individual frames, among which an onset is exact.
  static constexpr std::size_t kRecent = 64;
  /// Number of frames of a block: half a second at 30 Hz.
  static constexpr std::size_t kBlock = 15;
  // Number of blocks over which a drift is traced: two minutes at 30 Hz.
  static constexpr std::size_t kBlocks = 240;
  struct Entry {
    std::uint64_t frame = 0;
    Evidence evidence;
  };

  void clear() noexcept {
    count_ = closed_ = 0;
    open_ = Entry{};
    total_ = Evidence{};
  }
  /// Returns true if that closed a block, which is block(0) then.
  [[nodiscard]] bool push(const Entry& entry) noexcept;

  [[nodiscard]] std::size_t frames() const noexcept { return count_; }
  /// Number of blocks closed so far, and of those still kept.
  [[nodiscard]] std::size_t closed() const noexcept { return closed_; }
  [[nodiscard]] std::size_t blocks() const noexcept { return std::min(closed_, kBlocks); }
  /// Number of frames in the open block.
  [[nodiscard]] std::size_t open_frames() const noexcept { return count_ % kBlock; }
  /// Age 0 is the newest.
  [[nodiscard]] const Entry& recent(std::size_t age) const noexcept {
    return recent_[(count_ - 1 - age) % kRecent];
  }
  [[nodiscard]] const Entry& block(std::size_t age) const noexcept {
    return blocks_[(closed_ - 1 - age) % kBlocks];
  }
  /// Sums the evidence of the newest `frames` frames, extended to the edge of the block that holds
  /// the oldest of them.
  [[nodiscard]] Evidence sum_newest(std::size_t frames) const noexcept;
  /// Sum of the evidence of all frames kept.
  [[nodiscard]] Evidence total() const noexcept;

 private:
  // Numbers of frames and of full blocks; 32 bits last for four years at 30 Hz.
  std::size_t count_ = 0, closed_ = 0;
  std::array<Entry, kRecent> recent_{};
  std::array<Entry, kBlocks> blocks_{};
  // The block being filled.
  Entry open_{};
  // Sum over the kept blocks.
  Evidence total_{};
};

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
  // Two seconds at 30 Hz, chosen: after as many blocks the measurement outweighs the expectation.
  static constexpr double kExpectedBlocks = 4;
  double expected2_ = 0, sum_ = 0;
  std::uint64_t blocks_ = 0;
  bool used_ = false;
};

/// Change tests on the evidence of past moving frames in sliding windows. Independent of images and
/// tracks.
///
/// Memory  Fixed, in place (about 50 kB). Time: a few µs per frame; up to 0.1 ms during an alarm.
class ChangeDetector {
 public:
  /// `covariance`: of θ at the reference.
  void reset(const MonitorOptions& options, const Mat5& covariance) noexcept;
  void expect_scatter(double bias_px) noexcept;
  /// A frame that exceeds the threshold on its own counts only if the next one does as well: a
  /// knock lasts, whereas a distorted image (skewed exposure, a shaken rolling shutter) does not.
  void push(const StereoResiduals& e) noexcept;
  /// Combined result of all windows, without `rotation_mrad`.
  [[nodiscard]] MonitorResult decide() noexcept;
  /// Statistic of a single frame, for a standing rig; `spread` is its own inflation λ.
  [[nodiscard]] double single(const Evidence& frame, double spread) const noexcept;

 private:
  using Entry = EvidenceHistory::Entry;
  struct Onset {
    // Twice the log likelihood ratio against no change.
    double gain = 0;
    std::uint64_t frame = 0;
    // Evidence since the onset, not inflated; that of a ramp is weighted by the ramp.
    Evidence since;
  };
  struct Theta {
    Vec5 mean;
    Mat5 covariance;
  };
  struct Search {
    // A sudden change, and one that grows from zero.
    Onset step, ramp;
  };

  void follow_spread(const StereoResiduals& e) noexcept;
  void add(const StereoResiduals& e) noexcept;
  [[nodiscard]] bool stands_out(const StereoResiduals& e) const noexcept;
  void measure_scatter() noexcept;
  void renew_floor() noexcept;
  [[nodiscard]] Evidence effective(const Evidence& sum) const noexcept;
  [[nodiscard]] static double statistic(const Evidence& e, const Theta& reference) noexcept;
  /// θ by the past before the window, and its covariance.
  [[nodiscard]] Theta estimate_reference(const Evidence& window) const noexcept;
  [[nodiscard]] Search search(const Vec5& mean) const noexcept;
  void attribute(std::size_t window, MonitorResult* d) const noexcept;

  MonitorOptions options_{};
  Mat5 covariance_ = Mat5::Zero();
  // Variance of the slowly varying error per parameter, in px².
  double bias2_ = 0;
  BlockScatter scatter_{};
  std::array<std::size_t, 6> detector_{};
  std::size_t window_count_ = 0;
  EvidenceHistory history_;
  // Frame above the threshold that waits for the next one.
  std::optional<StereoResiduals> pending_;
  double lambda_ = 0;
  // Running means of the spreads.
  double now_fast_ = 0, now_slow_ = 0, life_slow_ = 0;
  double newest_statistic_ = 0;
  // Number of consecutive frames above the threshold.
  int over_ = 0;
};

}  // namespace vergence::calibration::detail
