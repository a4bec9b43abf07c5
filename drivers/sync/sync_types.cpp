#include "drivers/sync/sync_types.hpp"

#include <cstddef>

namespace vergence {
const char* to_string(SyncMode mode) noexcept {
  switch (mode) {
    case SyncMode::counter:
      return "counter";
    case SyncMode::software:
      return "software";
    case SyncMode::board:
      return "board";
    case SyncMode::ins_syncout:
      return "ins_syncout";
    case SyncMode::master_strobe:
      return "master_strobe";
    case SyncMode::bus:
      return "bus";
    case SyncMode::ptp:
      return "ptp";
    case SyncMode::one_picture:
      return "one_picture";
  }
  return "";
}

const char* to_string(SyncProof proof) noexcept {
  switch (proof) {
    case SyncProof::counted:
      return "counted";
    case SyncProof::unproven:
      return "unproven";
    case SyncProof::by_time:
      return "by_time";
    case SyncProof::numbered:
      return "numbered";
    case SyncProof::master:
      return "master";
    case SyncProof::common_clock:
      return "common_clock";
  }
  return "";
}

const char* SyncOptions::validate() const noexcept {
  if (cameras < 1 || cameras > kMaxCameras) return "a rig has one to four cameras";
  if (interval <= Duration{}) return "the interval between two pulses must be positive";
  if (hold <= Duration{}) return "the time a set waits for its images must be positive";
  if (pairs_by_time(mode) && (tolerance <= Duration{} || tolerance * 2 > interval))
    return "the tolerance must be positive and at most half of the interval between two exposures";
  if (mode == SyncMode::master_strobe && cameras < 2)
    return "a master without another camera triggers nobody";
  for (std::size_t k = 0; proves_numbers(mode) && k < static_cast<std::size_t>(cameras); ++k) {
    const SyncCameraOptions& c = camera[k];
    if (c.resolution < Duration{} || c.jitter < Duration{})
      return "a camera's stamps cannot be better than exact";
    if ((c.resolution + c.jitter) * 8 > interval)
      return "a camera's stamps are too coarse to distinguish consecutive pulses";
    if (c.latest <= Duration{})
      return "a frame arrives after its pulse: the latest arrival must be positive";
    if (c.delay < Duration{} || c.delay >= interval)
      return "a line's delay must be at least 0 and below the interval of the pulses";
  }
  return nullptr;
}

}  // namespace vergence
