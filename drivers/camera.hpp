#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/memory/frame_pool.hpp"
#include "core/types/image.hpp"
#include "drivers/device.hpp"
#include "drivers/options/options.hpp"

namespace vergence {

enum class CameraTrigger : std::uint8_t {
  /// Every pulse at the trigger input is one exposure.
  hardware,
  /// The driver requests each exposure.
  software,
  /// The camera's own clock starts exposures.
  free,
};
/// The configuration's value, as `hardware`.
[[nodiscard]] const char* to_string(CameraTrigger) noexcept;

/// Requested or applied configuration of a camera.
struct CameraConfiguration {
  int width = 0;   // px
  int height = 0;  // px
  /// Exposure rate; with a hardware trigger the maximum rate of the pulses.
  double rate_hz = 0;
  Duration exposure{};
  double gain_db = 0;
  CameraTrigger trigger = CameraTrigger::hardware;
  /// Offset of the region of interest on the sensor, px.
  int offset_x = 0;
  /// Offset of the region of interest on the sensor, px.
  int offset_y = 0;
  /// Name of the device (Mono8, BayerGB8, GREY …); if empty, the driver selects the cheapest format
  /// that gives grey.
  std::string pixel_format{};
  /// Options of this kind of camera; those of another kind are unsupported.
  CameraOptions options{};
  /// Number of cameras of the rig on this camera's link or bus, itself included; it determines its
  /// share of the bandwidth.
  int sharing = 1;
};

/// Validates a request for any camera: empty, or the problem, as in `a
/// size of 0 x 480`.
[[nodiscard]] std::string find_invalid(const CameraConfiguration& requested);

/// Exposure and gain while a camera streams.
struct ExposureSetting {
  Duration exposure{};
  double gain_db = 0;
  bool operator==(const ExposureSetting&) const = default;
};

enum class FrameStatus : std::uint8_t {
  complete,
  /// Parts of the image never came; their pixels are undefined.
  incomplete,
};

/// One exposure, handed out by wait().
struct Frame {
  FrameSlot slot = 0;
  /// Exposures since start(), from 0, unwrapped; gaps are frames that never came.
  std::uint64_t counter = 0;
  /// Start of the exposure by the camera's clock.
  DeviceStamp exposure_start{};
  /// Time when the last byte arrived.
  HostStamp arrival{};
  /// Exposure time of this frame.
  Duration exposure{};
  FrameStatus status = FrameStatus::complete;
  /// Gain of this frame.
  double gain_db = 0;
};

/// Counters since open; all only grow.
struct CameraStatistics {
  /// Frames returned by wait().
  std::uint64_t delivered = 0;
  /// Delivered frames that are incomplete.
  std::uint64_t torn = 0;
  /// Exposures dropped because no slot was free.
  std::uint64_t underruns = 0;
  /// Exposures that happened and never arrived.
  std::uint64_t lost = 0;
  /// Successful start() calls.
  std::uint64_t starts = 0;
};

/// One opened camera: gige, iidc, v4l2 and mock, all behind this.
///
///     DeviceStatus status = DeviceStatus::ok;
///     const std::unique_ptr<CameraDevice> camera = driver.open("", &status);  // "": the first
///     if (camera == nullptr) return;  // status and driver.last_error() say why
///     CameraConfiguration actual;
///     if (camera->configure({.width = 752, .height = 480, .rate_hz = 20}, &actual) !=
///             DeviceStatus::ok ||
///         camera->start(nullptr) != DeviceStatus::ok)
///       return;  // camera->last_error()
///     for (Frame frame; camera->wait(Duration::seconds(1), &frame) == DeviceStatus::ok;) {
///       if (frame.status == FrameStatus::complete)
///         use(camera->view(frame.slot), frame.exposure_start);
///       camera->release(frame.slot);
///     }
///
/// Ownership  A slot belongs to the camera until wait() hands it out, then to the caller until
///            release(). Slots are the transport's own buffers or those of a FramePool; either way
///            view() shows the pixels, without a copy.
/// Threads    configure, start, stop: the owner's thread. wait: one consumer thread. release: one
///            thread, the same or another. wait and release may overlap stop(). set_exposure: one
///            thread, may overlap everything but configure(). statistics: any.
/// Memory     No allocation by the caller's thread between start() and stop(). Slots are fixed at
///            configure().
/// Time       exposure_start by the device's clock, arrival by the host's (or by virtual time, for
///            a mock that runs faster).
/// Pixels     8-bit grey, row 0 on top; rows as the transport brings them, or padded to cache lines
///            where the driver converts. The padding is not initialised.
/// Full       With no slot free the newest exposure is dropped and counted (`underruns`); a mock in
///            virtual time waits instead.
/// Errors     Nothing throws. A call that is not `ok` has changed nothing but the counters and
///            *arrival.
class CameraDevice {
 public:
  /// Stops the camera.
  virtual ~CameraDevice() = default;

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// While not streaming and with every slot released, else `busy`. *actual (may be null): what the
  /// camera will do, rounded to what it can. → ok, unsupported, bad_configuration, busy,
  /// disconnected
  [[nodiscard]] virtual DeviceStatus configure(const CameraConfiguration& requested,
                                               CameraConfiguration* actual) noexcept = 0;
  /// From the start of an exposure to its arrival. Precondition: configured.
  [[nodiscard]] virtual DeviceTiming timing() const noexcept = 0;
  /// Starts streaming, also again after `disconnected`; while streaming it does nothing. `ready`
  /// (may be null) is notified of every frame and of a disconnect. → ok, disconnected, ended,
  /// no_permission, no_bandwidth, bad_configuration (not configured)
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Oldest frame not yet handed out, waiting at most `limit` (0: look once). `ok`: frame->slot is
  /// the caller's. `disconnected`: frame->arrival says when it was noticed. → ok, timeout, stopped,
  /// ended, disconnected
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, Frame* frame) noexcept = 0;
  /// Precondition: the slot was handed out and not yet released.
  [[nodiscard]] virtual ImageView view(FrameSlot slot) const noexcept = 0;
  /// Gives a slot back, in any order. Precondition as view().
  virtual void release(FrameSlot slot) noexcept = 0;
  /// Wakes wait() with `stopped`; no device access and no notify() after it returns. Twice is
  /// harmless.
  virtual void stop() noexcept = 0;
  /// One exposure, with CameraTrigger::software and while streaming. → ok, unsupported, stopped,
  /// disconnected
  [[nodiscard]] virtual DeviceStatus trigger_once() noexcept { return DeviceStatus::unsupported; }
  /// Exposure and gain from one of the next frames on, while streaming; those frames tell it, and a
  /// camera that comes back has it. Outside of what the camera has the nearest is taken; *actual
  /// (may be null): what it took. Talks to the device: as long as that, never for ever; not for a
  /// thread that has a frame to give. → ok, unsupported, bad_configuration (not positive, longer
  /// than the interval), stopped, disconnected, failed
  [[nodiscard]] virtual DeviceStatus set_exposure(const ExposureSetting& /*wanted*/,
                                                  ExposureSetting* /*actual*/) noexcept {
    return DeviceStatus::unsupported;
  }
  /// One message about the last call that was not `ok`: what was refused, what the camera offers,
  /// what to do. Empty: the status says it all. Owner's thread; may allocate.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
  /// One message about what works, but not as well as it should (a buffer the system made
  /// smaller): what, and what to do. Empty: nothing. Owner's thread; may allocate.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual CameraStatistics statistics() const noexcept = 0;
};

/// One kind of camera: a row in the table of drivers.
///
/// Ownership  A device may outlive its driver.
/// Not thread-safe. Memory: ordinary; before the drive only.
class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  /// `serial` empty: the first. Null: *status says why. → ok, not_found, no_permission, busy,
  /// unsupported (it is no such camera), failed
  [[nodiscard]] virtual std::unique_ptr<CameraDevice> open(std::string_view serial,
                                                           DeviceStatus* status) = 0;
  /// One message about the last open() that gave nothing, or enumerate() that found nothing.
  /// Empty: the status says it all.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence
