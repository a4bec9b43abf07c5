#pragma once
#include <array>
#include <cstdint>

#include "core/memory/frame_pool.hpp"
#include "core/types/calibration.hpp"
#include "drivers/sync/clock_mapper.hpp"

/// Input and output of a RigSynchronizer.
namespace vergence {

/// Method of pairing images, and of verifying that they were exposed together.
enum class SyncMode : std::uint8_t {
  /// Exposure n of every camera belongs to pulse n; the association is not verified.
  frame_counter,
  /// Exposures within `tolerance` by the host's clock form a set; the cameras need not expose
  /// simultaneously.
  approximate_time,
  /// Pulses of a trigger board, by number; dithered intervals or a pause verify which frame belongs
  /// to which pulse.
  board,
  /// As `board`, with pulses of the INS's SyncOut; a gap verifies the association.
  ins_syncout,
  /// Camera 0 triggers the others: its frames are the pulses, and a gap of its own verifies the
  /// association.
  master_strobe,
  /// Stamps of one IEEE 1394 cycle timer, which wraps after 128 s, within `tolerance`.
  ieee1394_cycle_time,
  /// Stamps of one PTP clock, within `tolerance`.
  ptp,
  /// One camera delivers both images side by side (side_by_side_camera.hpp), with one exposure and
  /// one stamp.
  side_by_side,
};
[[nodiscard]] const char* to_string(SyncMode) noexcept;
/// True if frames are associated with pulses given to RigSynchronizer::pulse().
[[nodiscard]] constexpr bool requires_pulses(SyncMode m) noexcept {
  return m == SyncMode::board || m == SyncMode::ins_syncout;
}
/// True if frames are associated with numbered pulses and this is verified.
[[nodiscard]] constexpr bool verifies_numbers(SyncMode m) noexcept {
  return requires_pulses(m) || m == SyncMode::master_strobe;
}
/// True if the mode verifies that the images of a set were exposed together.
[[nodiscard]] constexpr bool verifies_pairing(SyncMode m) noexcept {
  return m != SyncMode::frame_counter && m != SyncMode::approximate_time;
}
/// True if frames are paired by their stamps.
[[nodiscard]] constexpr bool pairs_by_time(SyncMode m) noexcept {
  return m == SyncMode::approximate_time || m == SyncMode::ieee1394_cycle_time ||
         m == SyncMode::ptp || m == SyncMode::side_by_side;
}

/// Options of one camera for the modes with pulses.
struct SyncCameraOptions {
  /// Delay from the pulse's edge to the start of the exposure, by line and camera.
  Duration delay{};
  /// Resolution of the camera's stamps, as DeviceTiming::resolution.
  Duration resolution = Duration::microseconds(1);
  /// Bound on the deviation of a stamp from the edge plus a constant: tens of µs for stamps of the
  /// camera, milliseconds (DeviceTiming::delay_spread) for those of the host. If it exceeds half
  /// the dither of the intervals, only a pause verifies.
  Duration jitter = Duration::microseconds(20);
  /// Upper bound of the time from a pulse to the arrival of its frame. Choose it conservatively:
  /// frames that arrive later are not used to verify the pairing.
  Duration latest = Duration::milliseconds(500);
};

struct SyncOptions {
  /// 1 to kMaxCameras.
  int cameras = 2;
  /// Interval between two pulses, > 0; the mean interval if it is dithered.
  Duration interval{};
  /// Maximum wait of a set for images and the pulse's report, by the arrivals of other frames.
  Duration hold = Duration::milliseconds(100);
  SyncMode mode = SyncMode::frame_counter;
  /// Maximum difference between the middles of a set's exposures, in modes that pair by time.
  Duration tolerance = Duration::milliseconds(2);
  /// frame_counter: aligns each camera's first exposure to its pulse by its stamp, because the
  /// pulses may start before the cameras; again after kAmbiguous ambiguous sets in a row.
  bool align_start = false;
  /// Used by board, ins_syncout and master_strobe.
  std::array<SyncCameraOptions, kMaxCameras> camera{};
  /// Returns nullptr if the options are valid, else a message.
  [[nodiscard]] const char* validate() const noexcept;
};

/// Frame offered to the synchroniser.
struct SyncFrame {
  int camera = 0;
  FrameSlot slot = 0;
  /// Frame::counter.
  std::uint64_t counter = 0;
  /// Middle of the exposure in host time.
  MappedStamp middle{};
  HostStamp arrival{};
  /// Frame::exposure_start, by the camera's clock. Ignored with frame_counter and approximate_time.
  DeviceStamp exposure_start{};
  /// Frame::exposure. Ignored in the same modes.
  Duration exposure{};
};

/// Evidence that a set's images were exposed together.
enum class SyncProof : std::uint8_t {
  /// Paired by counter, and the stamps agree within half an interval (or there is only one image).
  counted,
  /// Paired by counter or a common clock, and the host's stamps, the cameras' clocks or the report
  /// of the pulse contradict it. Do not estimate from such a set.
  ambiguous,
  /// Paired by the host's stamps.
  by_time,
  /// Every image belongs to this pulse, as verified by the intervals of its camera.
  numbered,
  /// As `numbered`, with camera 0's exposures as pulses.
  master,
  /// Paired by stamps of one common clock.
  common_clock,
};
[[nodiscard]] const char* to_string(SyncProof) noexcept;

/// Images of one pulse.
///
/// stamp   Mid-exposure, common to all images. With pulses it is the edge on the host's clock +
///         delay + exposure / 2, or the middle measured on the feedback input; otherwise the middle
///         of the exposure by the camera's stamp. The reference is camera 0, or the first present
///         one.
/// spread  Largest distance of another image's middle from it, due to unequal exposures.
struct SyncedSet {
  /// Number of the pulse. Unlike the trigger board's number, it keeps increasing across a restart.
  std::uint64_t number = 0;
  HostStamp stamp{};
  /// Upper bound of |true − stamp|.
  Duration error{};
  Duration spread{};
  /// Arrival of the last image.
  HostStamp arrival{};
  std::array<bool, kMaxCameras> present{};
  std::array<FrameSlot, kMaxCameras> slots{};
  /// Arrivals of the images that are present.
  std::array<HostStamp, kMaxCameras> arrivals{};
  bool complete = false;
  /// True if the pulse's report arrived; otherwise, with pulses, the stamp is computed from the
  /// camera's clock.
  bool reported = false;
  SyncProof proof = SyncProof::counted;
};

enum class SyncResult : std::uint8_t {
  /// The slot is returned with its set.
  accepted,
  /// The camera already gave this pulse; the slot stays the caller's.
  duplicate,
  /// The set of the frame was output without it, or its stamp fits no set; the slot stays the
  /// caller's.
  late,
  /// The pulse of the frame is not verified yet; the slot stays the caller's.
  acquiring,
};

/// Counters; all only grow.
struct SyncCounters {
  /// Complete and incomplete sets that were output.
  std::uint64_t complete = 0, incomplete = 0;
  /// Pulses without an image of any camera.
  std::uint64_t missed = 0;
  /// Exposures without an image while the camera was connected; in modes by time, sets without that
  /// camera.
  std::array<std::uint64_t, kMaxCameras> lost{};
  /// Sets without that camera while it was disconnected.
  std::array<std::uint64_t, kMaxCameras> absent{};
  std::array<std::uint64_t, kMaxCameras> duplicate{};
  std::array<std::uint64_t, kMaxCameras> late{};
  /// Incomplete sets that were output early because more than kOpen pulses were open.
  std::uint64_t pushed_out = 0;
  /// Sets whose stamps do not agree.
  std::uint64_t ambiguous = 0;
  /// Times that the pulses of all cameras were found by their stamps again.
  std::uint64_t realigned = 0;
  // The following apply to numbered pulses.

  /// Pulses that this camera did not expose.
  std::array<std::uint64_t, kMaxCameras> missed_trigger{};
  /// Frames returned while their pulse was not verified.
  std::array<std::uint64_t, kMaxCameras> acquiring{};
  /// Times that the camera's pulses were verified.
  std::array<std::uint64_t, kMaxCameras> acquisitions{};
  /// Times that counter, stamp and pulses did not agree, which starts a new acquisition.
  std::array<std::uint64_t, kMaxCameras> contradictions{};
  /// Times that the pulses restarted, which starts a new acquisition of all cameras.
  std::uint64_t reboots = 0;
  /// Sets that were output without the report of their pulse.
  std::uint64_t unreported = 0;
  /// Longest time from the first frame after a (re)start or contradiction to the verification.
  Duration worst_acquisition{};
};

}  // namespace vergence
