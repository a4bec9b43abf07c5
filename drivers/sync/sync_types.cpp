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
  if (cameras < 1 || cameras > kMaxCameras) return "the number of cameras must be 1 to 4";
  if (interval <= Duration{}) return "trigger.rate must be positive";
  if (hold <= Duration{}) return "sync.timeout_ms must be positive";
  if (pairs_by_time(mode) && (tolerance <= Duration{} || tolerance * 2 > interval))
    return "sync.tolerance_ms must be positive and at most half of the frame interval (1000 / "
           "trigger.rate)";
  if (mode == SyncMode::master_strobe && cameras < 2)
    return "camera 0 triggers the others, but no other camera is configured; add one";
  for (std::size_t k = 0; verifies_numbers(mode) && k < static_cast<std::size_t>(cameras); ++k) {
    const SyncCameraOptions& c = camera[k];
    if (c.resolution < Duration{} || c.jitter < Duration{})
      return "cameras.N.stamp_jitter_us must be at least 0";
    if ((c.resolution + c.jitter) * 8 > interval)
      return "cameras.N.stamp_jitter_us is too large for trigger.rate: consecutive pulses cannot "
             "be distinguished";
    if (c.latest <= Duration{})
      return "a frame arrives after its pulse: the latest arrival must be positive";
    if (c.delay < Duration{} || c.delay >= interval)
      return "cameras.N.trigger_delay_us must be at least 0 and below the pulse interval (1e6 / "
             "trigger.rate)";
  }
  return nullptr;
}

}  // namespace vergence
