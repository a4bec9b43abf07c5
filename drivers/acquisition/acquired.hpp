#pragma once
#include <cstdint>
#include <variant>

#include "core/types/ins_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/camera.hpp"
#include "drivers/ins.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

/// Output of an acquisition: values of fixed size that are passed through rings.
namespace vergence {

/// Images of one pulse. `rig.images` are views of the slots, valid until the frame is released.
struct AcquiredFrame {
  RigFrame rig{};
  /// Slots of the images and the synchroniser's state.
  SyncedSet set{};
};

/// Change of state of a device.
struct DeviceEvent {
  enum class Kind : std::uint8_t {
    camera_disconnected,
    camera_reconnected,
    trigger_board_disconnected,
    trigger_board_reconnected,
    trigger_board_restarted,
    /// The association of the camera's frames with pulses is no longer verified.
    pairing_pending,
    /// The association is verified again.
    pairing_verified,
  } kind = Kind::camera_disconnected;
  Stamp stamp{};
  /// Camera index, for camera_… and pairing_….
  int camera = 0;
  /// For pairing_verified, the time since the first frame that was not verified.
  double seconds = 0;
};

/// Receives every complete frame of a camera before it is paired. Called on the acquisition's
/// thread; must not block.
class FrameObserver {
 public:
  virtual ~FrameObserver() = default;
  virtual void on_frame(std::size_t camera, const Frame& frame) noexcept = 0;
};

/// Receives the trigger board's pulses on arrival, to record them. Called on the acquisition's
/// thread; must not block.
class PulseObserver {
 public:
  virtual ~PulseObserver() = default;
  /// `arrival` is when the report arrived. `edge` is pulse.host, valid if pulse.mapped.
  virtual void on_pulse(Stamp arrival, const Pulse& pulse, Stamp edge) noexcept = 0;
};

using Acquired = std::variant<AcquiredFrame, InsRecord, DeviceEvent>;

[[nodiscard]] inline Stamp item_stamp(const Acquired& item) noexcept {
  if (const auto* frame = std::get_if<AcquiredFrame>(&item)) return frame->rig.stamp;
  if (const auto* reading = std::get_if<InsRecord>(&item)) return reading->sample.stamp;
  return std::get_if<DeviceEvent>(&item)->stamp;
}

/// Converts the synchroniser's evidence to the estimator's pairing.
[[nodiscard]] constexpr Pairing to_pairing(SyncMode mode, SyncProof proof) noexcept {
  if (!verifies_pairing(mode)) return Pairing::assumed;
  return proof == SyncProof::ambiguous ? Pairing::contradicted : Pairing::verified;
}

}  // namespace vergence
