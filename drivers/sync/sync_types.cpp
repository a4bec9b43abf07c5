#include "drivers/sync/sync_types.hpp"

#include <array>
#include <cstddef>

#include "core/types/names.hpp"

namespace vergence {
const char* to_string(SyncMode mode) noexcept {
  return name_of(mode, std::array{"frame_counter", "approximate_time", "board", "ins_syncout",
                                  "master_strobe", "ieee1394_cycle_time", "ptp", "side_by_side"});
}

const char* to_string(SyncProof proof) noexcept {
  return name_of(
      proof, std::array{"counted", "ambiguous", "by_time", "numbered", "master", "common_clock"});
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
