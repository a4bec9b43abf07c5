#include "core/calibration/detail/evidence_history.hpp"

namespace vergence::calibration::detail {

bool EvidenceHistory::push(const Entry& entry) noexcept {
  recent_[count_ % kRecent] = entry;
  if (count_ % kBlock == 0) open_ = Entry{entry.frame, {}};
  open_.evidence.add(entry.evidence);
  ++count_;
  return count_ % kBlock == 0;
}

void EvidenceHistory::close_block() noexcept {
  if (closed_ >= kBlocks) total_.add(blocks_[closed_ % kBlocks].evidence, -1.0);
  total_.add(open_.evidence);
  blocks_[closed_ % kBlocks] = open_;
  ++closed_;
  open_ = Entry{};
}

void EvidenceHistory::sum_newest(std::size_t frames, Evidence* sum) const noexcept {
  *sum = open_.evidence;
  const std::size_t open = open_frames();
  const std::size_t count =
      std::min((frames - std::min(frames, open) + kBlock - 1) / kBlock, blocks());
  for (std::size_t i = 0; i < count; ++i) sum->add(block(i).evidence);
}

Evidence EvidenceHistory::total() const noexcept {
  Evidence sum = total_;
  sum.add(open_.evidence);
  return sum;
}

}  // namespace vergence::calibration::detail
