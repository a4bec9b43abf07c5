#pragma once
#include <cstdint>
#include <variant>

#include "core/types/ins_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/camera.hpp"
#include "drivers/ins.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

/// Output of an acquisition: plain values of fixed size that go through rings.
namespace vergence {

/// The images of one pulse. `rig.images` are views of the slots, valid until the frame is released.
struct AcquiredFrame {
  RigFrame rig{};
  SyncedSet set{};  // the slots, and what the synchroniser knows of them
};

/// Something that happened to a device.
struct DeviceEvent {
  enum class Kind : std::uint8_t {
    camera_disconnected,
    camera_reconnected,
    trigger_board_disconnected,
    trigger_board_reconnected,
    trigger_board_restarted,
    pairing_pending,   // nothing proves any more which pulses the camera's frames belong to
    pairing_verified,  // now something does
  } kind = Kind::camera_disconnected;
  Stamp stamp{};
  int camera = 0;      // camera_…, pairing_…
  double seconds = 0;  // verified: since the first frame that was not
};

/// Receives every whole frame of a camera when it is taken, before it is paired.
///
/// Threads  The acquisition's; the call must not wait.
class FrameObserver {
 public:
  virtual ~FrameObserver() = default;
  virtual void on_frame(std::size_t camera, const Frame& frame) noexcept = 0;
};

/// Receives the trigger board's pulses as they arrive, to record them.
///
/// Threads  The acquisition's; the call must not wait.
class PulseObserver {
 public:
  virtual ~PulseObserver() = default;
  /// `arrival`: when the report arrived. `edge`: pulse.host, where pulse.mapped says that the
  /// driver mapped it.
  virtual void on_pulse(Stamp arrival, const Pulse& pulse, Stamp edge) noexcept = 0;
};

using Acquired = std::variant<AcquiredFrame, InsRecord, DeviceEvent>;

[[nodiscard]] inline Stamp stamp_of(const Acquired& item) noexcept {
  if (const auto* frame = std::get_if<AcquiredFrame>(&item)) return frame->rig.stamp;
  if (const auto* reading = std::get_if<InsRecord>(&item)) return reading->sample.stamp;
  return std::get_if<DeviceEvent>(&item)->stamp;
}

/// Converts the synchroniser's evidence to the estimator's pairing.
[[nodiscard]] constexpr Pairing pairing_of(SyncMode mode, SyncProof proof) noexcept {
  if (!verifies_pairing(mode)) return Pairing::assumed;
  return proof == SyncProof::ambiguous ? Pairing::contradicted : Pairing::verified;
}

}  // namespace vergence
