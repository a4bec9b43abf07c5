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
  /// Width of the image, in pixels.
  int width = 0;
  /// Height of the image, in pixels.
  int height = 0;
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

/// Validates a request for any camera. Returns an empty string, or the problem (`a size of 0 x
/// 480`).
[[nodiscard]] std::string find_invalid(const CameraConfiguration& requested);

/// Exposure and gain while a camera streams.
struct ExposureSetting {
  Duration exposure{};
  double gain_db = 0;
  bool operator==(const ExposureSetting&) const = default;
};

enum class FrameStatus : std::uint8_t {
  complete,
  /// Parts of the image were not received; their pixels are undefined.
  incomplete,
};

/// One exposure, handed out by wait().
struct Frame {
  FrameSlot slot = 0;
  /// Number of exposures since start(), from 0 and unwrapped; a gap is a frame that was not
  /// received.
  std::uint64_t counter = 0;
  /// Start of the exposure, on the camera's clock.
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
  std::uint64_t incomplete = 0;
  /// Exposures dropped because no slot was free.
  std::uint64_t underruns = 0;
  /// Exposures that were not received.
  std::uint64_t lost = 0;
  /// Successful start() calls.
  std::uint64_t starts = 0;
};

/// Interface of one opened camera of any kind (gige, iidc, v4l2, mock).
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
///            release(). Slots are the transport's own buffers or those of a FramePool. In both
///            cases view() shows the pixels without a copy.
/// Threads    configure, start, stop: the owner's thread. wait: one consumer thread. release: one
///            thread, the same or another. wait and release may overlap stop(). set_exposure: one
///            thread, may overlap everything but configure(). statistics: any.
/// Memory     The caller's threads do not allocate between start() and stop(). configure() fixes
///            the slots.
/// Time       exposure_start is on the device's clock, arrival on the host's (or in virtual time,
///            for a mock that runs faster than real time).
/// Pixels     8-bit grey, row 0 on top. Rows have the transport's stride, or are padded to cache
///            lines if the driver converts. The padding is not initialised.
/// Full       If no slot is free, the newest exposure is dropped and counted (`underruns`); a mock
///            in virtual time waits instead.
/// Errors     No call throws. A call that does not return `ok` changes only the counters and
///            *arrival.
class CameraDevice {
 public:
  /// Stops the camera.
  virtual ~CameraDevice() = default;

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// Applies a configuration. Fails with `busy` while streaming or while a slot is held. *actual
  /// (may be null) receives the values rounded to what the camera supports. → ok, unsupported,
  /// bad_configuration, busy, disconnected
  [[nodiscard]] virtual DeviceStatus configure(const CameraConfiguration& requested,
                                               CameraConfiguration* actual) noexcept = 0;
  /// Delays from the start of an exposure to its arrival. Precondition: configured.
  [[nodiscard]] virtual DeviceTiming timing() const noexcept = 0;
  /// Starts streaming, also after `disconnected`; does nothing while streaming. `ready` (may be
  /// null) is notified of every frame and of a disconnect. → ok, disconnected, ended,
  /// no_permission, no_bandwidth, bad_configuration (not configured)
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Returns the oldest frame not yet handed out and waits at most `limit` for it (0: does not
  /// wait). With `ok`, frame->slot belongs to the caller. With `disconnected`, frame->arrival is
  /// the time when the disconnect was detected. → ok, timeout, stopped, ended, disconnected
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, Frame* frame) noexcept = 0;
  /// Precondition: the slot was handed out and not yet released.
  [[nodiscard]] virtual ImageView view(FrameSlot slot) const noexcept = 0;
  /// Returns a slot to the camera, in any order. Same precondition as view().
  virtual void release(FrameSlot slot) noexcept = 0;
  /// Wakes wait() with `stopped`. There is no device access and no notify() after it returns. May
  /// be called twice.
  virtual void stop() noexcept = 0;
  /// Triggers one exposure; requires CameraTrigger::software and a running stream. → ok,
  /// unsupported, stopped, disconnected
  [[nodiscard]] virtual DeviceStatus trigger_once() noexcept { return DeviceStatus::unsupported; }
  /// Changes exposure and gain while streaming, starting with one of the next frames; each frame
  /// carries its own values. A camera that reconnects keeps the setting. Values out of range are
  /// clamped; *actual (may be null) receives the applied ones. The call blocks while it accesses
  /// the device, so the thread that delivers frames must not make it. → ok, unsupported,
  /// bad_configuration (not positive, longer than the interval), stopped, disconnected, failed
  [[nodiscard]] virtual DeviceStatus set_exposure(const ExposureSetting& /*wanted*/,
                                                  ExposureSetting* /*actual*/) noexcept {
    return DeviceStatus::unsupported;
  }
  /// Message about the last call that was not `ok`: the refused request, what the camera offers and
  /// the fix. Empty if the status is sufficient. Call from the owner's thread; may allocate.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
  /// Message about a limitation that does not prevent operation (a buffer that the system made
  /// smaller), with the fix; empty if there is none. Call from the owner's thread; may allocate.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual CameraStatistics statistics() const noexcept = 0;
};

/// Driver for one kind of camera: a row in the table of drivers.
///
/// A device may outlive its driver. Not thread-safe. Allocates, so it is used only before a run.
class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  /// Opens the camera with this serial number, or the first one if `serial` is empty. Returns null
  /// if it fails; *status has the reason. → ok, not_found, no_permission, busy, unsupported (a
  /// device of another kind), failed
  [[nodiscard]] virtual std::unique_ptr<CameraDevice> open(std::string_view serial,
                                                           DeviceStatus* status) = 0;
  /// Message about the last open() or enumerate() that found no device; empty if the status is
  /// sufficient.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence
