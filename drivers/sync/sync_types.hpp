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
  frame_counter,     // exposure n of every camera belongs to pulse n; nothing proves it
  approximate_time,  // what was exposed within `tolerance` by the host's clock belongs together:
                     // nothing makes the cameras expose at once
  board,  // a trigger board's pulses, by number; intervals that vary, or a pause, prove which frame
          // is of which
  ins_syncout,          // as `board`, with the INS's SyncOut for pulses; a gap proves
  master_strobe,        // camera 0 triggers the others: its frames are the pulses; a gap of its own
                        // proves
  ieee1394_cycle_time,  // the stamps are of one IEEE 1394 cycle timer, which wraps after 128 s:
                        // within `tolerance` in it
  ptp,                  // the stamps are of one PTP clock: within `tolerance` in it
  side_by_side,  // both images come in one picture of one camera (side_by_side_camera.hpp), with
                 // one stamp
};
[[nodiscard]] const char* to_string(SyncMode) noexcept;
/// Frames are tied to pulses that are offered by RigSynchronizer::pulse().
[[nodiscard]] constexpr bool wants_pulses(SyncMode m) noexcept {
  return m == SyncMode::board || m == SyncMode::ins_syncout;
}
/// Frames are tied to numbered pulses, by proof.
[[nodiscard]] constexpr bool proves_numbers(SyncMode m) noexcept {
  return wants_pulses(m) || m == SyncMode::master_strobe;
}
/// Something proves that the images of a set were exposed together.
[[nodiscard]] constexpr bool verifies_pairing(SyncMode m) noexcept {
  return m != SyncMode::frame_counter && m != SyncMode::approximate_time;
}
/// Frames are paired by their stamps.
[[nodiscard]] constexpr bool pairs_by_time(SyncMode m) noexcept {
  return m == SyncMode::approximate_time || m == SyncMode::ieee1394_cycle_time ||
         m == SyncMode::ptp || m == SyncMode::side_by_side;
}

/// Options of one camera for the modes with pulses.
struct SyncCameraOptions {
  Duration delay{};  // from the pulse's edge to the start of the exposure, of line and camera
  Duration resolution =
      Duration::microseconds(1);  // of the camera's stamps: DeviceTiming::resolution
  /// By how much a stamp may be off the edge plus a constant: tens of µs where the camera stamps,
  /// milliseconds (DeviceTiming::delay_spread) where its stamps are the host's. With more than half
  /// of what the intervals vary by only a pause proves.
  Duration jitter = Duration::microseconds(20);
  /// Upper bound of the time from a pulse to the arrival of its frame. Choose it conservatively:
  /// frames that arrive later are not used to verify the pairing.
  Duration latest = Duration::milliseconds(500);
};

struct SyncOptions {
  int cameras = 2;      // 1 … kMaxCameras
  Duration interval{};  // between two pulses, > 0; the mean, where they vary
  Duration hold = Duration::milliseconds(
      100);  // a set waits so long, by the arrivals of others, for images and the pulse's report
  SyncMode mode = SyncMode::frame_counter;
  Duration tolerance = Duration::milliseconds(
      2);  // modes that pair by time: between the middles of a set's exposures
  /// frame_counter: the pulses may have begun before the cameras, so each camera's first exposure
  /// is given its pulse by its stamp; and again after kAmbiguous ambiguous sets in a row.
  bool align_start = false;
  std::array<SyncCameraOptions, kMaxCameras> camera{};  // board, ins_syncout, master_strobe
  /// Returns nullptr if the options are valid, else a message.
  [[nodiscard]] const char* validate() const noexcept;
};

/// One camera's frame on its way into a set.
struct SyncFrame {
  int camera = 0;
  FrameSlot slot = 0;
  std::uint64_t counter = 0;  // of Frame
  MappedStamp middle{};       // of the exposure, host time
  HostStamp arrival{};
  DeviceStamp exposure_start{};  // of Frame: by the camera's own clock. Ignored in the modes
                                 // frame_counter and approximate_time
  Duration exposure{};           // of Frame. Ignored as above
};

/// Evidence that a set's images were exposed together.
enum class SyncProof : std::uint8_t {
  counted,       // paired by counter, and the stamps agree within half an interval (also: one image
                 // only)
  ambiguous,     // paired by counter or a common clock, and the host's stamps do not agree, or a
                 // camera's clock is not the others'; or a pulse's report contradicts: do not
                 // estimate from it
  by_time,       // paired by the host's stamps
  numbered,      // every image belongs to this numbered pulse, as its camera's own intervals proved
  master,        // the same with camera 0's exposures for pulses
  common_clock,  // paired by stamps of one common clock
};
[[nodiscard]] const char* to_string(SyncProof) noexcept;

/// The images of one pulse.
///
/// stamp   Mid-exposure, one for all images. With pulses: their edge on the host's clock + delay +
///         exposure / 2 of camera 0, or the middle that the feedback line told; without camera 0 of
///         the first that is there. Else that camera's own.
/// spread  The largest distance of another image's middle to it: unequal exposures.
struct SyncedSet {
  std::uint64_t number =
      0;  // of the pulse; grows. With a board's reboot it goes on, as the board's own does not
  HostStamp stamp{};
  Duration error{};  // |true − stamp| is below this
  Duration spread{};
  HostStamp arrival{};  // of the last image
  std::array<bool, kMaxCameras> present{};
  std::array<FrameSlot, kMaxCameras> slots{};
  std::array<HostStamp, kMaxCameras> arrivals{};  // of those that are present
  bool complete = false;
  bool reported = false;  // the pulse's report was here; else, with pulses, the stamp is reckoned
                          // from the camera's clock
  SyncProof proof = SyncProof::counted;
};

enum class SyncResult : std::uint8_t {
  taken,      // the slot comes out with its set
  duplicate,  // that camera has given this pulse already; the slot stays the caller's
  late,       // its set has gone out without it, or by its stamp it is of none; the slot stays the
              // caller's
  acquiring,  // nothing proves yet which pulse it is of; the slot stays the caller's
};

/// Counters; all only grow.
struct SyncCounters {
  std::uint64_t complete = 0, incomplete = 0;  // sets that went out
  std::uint64_t missed = 0;                    // pulses no camera gave an image of
  std::array<std::uint64_t, kMaxCameras>
      lost{};  // exposures without image, while it was there. By time: sets without that camera
  std::array<std::uint64_t, kMaxCameras> absent{};  // sets without that camera while it was gone
  std::array<std::uint64_t, kMaxCameras> duplicate{};
  std::array<std::uint64_t, kMaxCameras> late{};
  std::uint64_t pushed_out =
      0;  // of the incomplete: before their time, because more pulses were open than kOpen
  std::uint64_t ambiguous = 0;  // sets whose stamps do not agree
  std::uint64_t realigned = 0;  // times that all cameras' pulses were found by their stamps again
  // With numbered pulses:
  std::array<std::uint64_t, kMaxCameras>
      missed_trigger{};  // pulses that this camera did not expose
  std::array<std::uint64_t, kMaxCameras>
      acquiring{};  // frames given back while nothing proved their pulse
  std::array<std::uint64_t, kMaxCameras> acquisitions{};  // times that its pulses were verified
  std::array<std::uint64_t, kMaxCameras>
      contradictions{};  // times that counter, stamp and pulses did not agree: it acquires again
  std::uint64_t reboots = 0;     // times that the pulses began again: all acquire again
  std::uint64_t unreported = 0;  // sets that went out without their pulse's report
  Duration
      worst_acquisition{};  // from the first frame after a (re)start or contradiction to the proof
};

}  // namespace vergence
