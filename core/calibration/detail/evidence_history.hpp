#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "core/calibration/detail/monitor_evidence.hpp"

namespace vergence::calibration::detail {

/// Evidence of past moving frames: recent ones individually, older ones summed in blocks. When it
/// is full, the oldest block is dropped. A value of about 50 kB.
class EvidenceHistory {
 public:
  /// Number of individual frames, among which an onset is exact.
  static constexpr std::size_t kRecent = 64;
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
  /// Returns true if the open block is full; use it, then call close_block().
  [[nodiscard]] bool push(const Entry& entry) noexcept;
  void close_block() noexcept;

  [[nodiscard]] std::size_t frames() const noexcept { return count_; }
  /// Number of blocks closed so far, and of those still kept.
  [[nodiscard]] std::size_t closed() const noexcept { return closed_; }
  [[nodiscard]] std::size_t blocks() const noexcept { return std::min(closed_, kBlocks); }
  /// Number of frames in the open block.
  [[nodiscard]] std::size_t open_frames() const noexcept { return count_ % kBlock; }
  [[nodiscard]] const Entry& open() const noexcept { return open_; }
  /// Age 0 is the newest.
  [[nodiscard]] const Entry& recent(std::size_t age) const noexcept {
    return recent_[(count_ - 1 - age) % kRecent];
  }
  [[nodiscard]] const Entry& block(std::size_t age) const noexcept {
    return blocks_[(closed_ - 1 - age) % kBlocks];
  }
  /// Sums the evidence of the newest `frames` frames, extended to the edge of the block that holds
  /// the oldest of them.
  void sum_newest(std::size_t frames, Evidence* sum) const noexcept;
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

}  // namespace vergence::calibration::detail
