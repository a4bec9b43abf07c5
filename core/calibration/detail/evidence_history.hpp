#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "core/calibration/detail/monitor_evidence.hpp"

namespace vergence::calibration::detail {

/// The evidence of past moving frames: the newest one by one, older ones summed by blocks. A value;
/// fixed, in place (some 50 kB). Full: the oldest block goes.
class EvidenceHistory {
 public:
  static constexpr std::size_t kRecent = 64;  // single frames: an onset among them is exact
  static constexpr std::size_t kBlock = 15;   // frames that older ones are summed by
  // Two minutes at 30 Hz: how far back a drift is traced.
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
  /// True: the block being filled is full, to be looked at before close_block().
  [[nodiscard]] bool push(const Entry& entry) noexcept;
  void close_block() noexcept;

  [[nodiscard]] std::size_t frames() const noexcept { return count_; }
  /// Blocks closed so far, those that are gone included, and those that are there.
  [[nodiscard]] std::size_t closed() const noexcept { return closed_; }
  [[nodiscard]] std::size_t blocks() const noexcept { return std::min(closed_, kBlocks); }
  /// Frames of the block being filled.
  [[nodiscard]] std::size_t open_frames() const noexcept { return count_ % kBlock; }
  [[nodiscard]] const Entry& open() const noexcept { return open_; }
  /// age 0: the newest.
  [[nodiscard]] const Entry& recent(std::size_t age) const noexcept {
    return recent_[(count_ - 1 - age) % kRecent];
  }
  [[nodiscard]] const Entry& block(std::size_t age) const noexcept {
    return blocks_[(closed_ - 1 - age) % kBlocks];
  }
  /// Sums the evidence of the newest `frames` frames, extended to the edge of the block that holds
  /// the oldest of them.
  void sum_of(std::size_t frames, Evidence* sum) const noexcept;
  /// Sum of the evidence of all frames kept.
  [[nodiscard]] Evidence total() const noexcept;

 private:
  // Frames, full blocks; where indices have 32 bits, 30 Hz for four and a half years.
  std::size_t count_ = 0, closed_ = 0;
  std::array<Entry, kRecent> recent_{};
  std::array<Entry, kBlocks> blocks_{};
  Entry open_{};      // the block being filled
  Evidence total_{};  // of the blocks kept
};

}  // namespace vergence::calibration::detail
