#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/ins.hpp"
#include "drivers/mock/ins_model.hpp"
#include "drivers/mock/rig_truth.hpp"
#include "drivers/mock/world/renderer.hpp"
#include "drivers/trigger.hpp"

namespace vergence::mock {

/// Properties of the simulated devices in addition to their configuration.
struct MockRigOptions {
  /// In virtual time the producer waits for the consumer.
  bool real_time = false;
  std::uint64_t seed = 1;
  /// With `gbrg` the grey image is made of the mosaic, as drivers of colour cameras do.
  Pattern pattern = Pattern::grey;
  /// With `gbrg`, outputs the mosaic itself, to write a data set.
  bool raw = false;
  /// Adds shot and read noise of the sensors.
  bool noise = true;
  /// Number of poses averaged over an exposure; 1 means no blur. The rendering time is
  /// proportional.
  int blur_samples = 1;
  bool ideal_ins = false;
  /// Maximum drift of the devices' clocks; each clock has its own.
  double clock_drift_ppm = 30;
  /// Duration of the drive; zero means all of it.
  Duration duration{};
  /// Delay from a pulse's edge to the start of the exposure, by camera.
  std::array<Duration, kMaxCameras> trigger_delay{};
  /// Virtual time: the consumer reads the trigger board's reports in order of arrival. The
  /// simulation then stays close behind the reports, so that a pause begins at the same pulse on
  /// every run: the fourth after the newest report read.
  bool reports_read = false;
  /// Virtual time: the consumer finishes an image before it waits for camera 0 again, and may set
  /// the exposure in between. No image is then rendered ahead, so set_exposure() takes effect at
  /// the same image on every run.
  bool exposures_follow = false;
};

/// Simulated rig: cameras, INS and trigger board behind the drivers' interfaces, on a vehicle that
/// drives through a world.
///
/// The drive starts with the trigger (after the cameras and the INS), with pulse 0 at time 0. Every
/// device has a clock with offset and drift; arrivals have a minimum delay and jitter. A pulse goes
/// to every camera whose line is pulsed; the exposure starts `trigger_delay` later. With feedback
/// the report has the exposures in whole microseconds and its edge on the host's clock to 20 µs. It
/// follows the last exposure, or just precedes the next pulse if one did not happen.
/// Ownership  The rig owns the devices and must outlive their use.
/// Threads    Two threads render images, one camera each; in real time another delivers them when
///            due.
/// Time       Virtual: arrivals are computed and nothing waits for a clock. Items become visible in
///            order of arrival over all devices, so a consumer that merges by arrival gets the same
///            on every run. Real: a pulse that the renderer cannot keep up with has no frames
///            (`lost`), a frame without a slot is dropped (`underruns`).
/// Errors     The constructor throws std::invalid_argument. The devices follow their interfaces.
class MockRig {
 public:
  /// Slots per camera, for the synchroniser, the estimator and the images being rendered.
  static constexpr std::size_t kSlots = 24;

  MockRig(std::shared_ptr<const RigTruth> truth, const MockRigOptions& options);
  ~MockRig();

  [[nodiscard]] int cameras() const noexcept;
  [[nodiscard]] CameraDevice& camera(int k) noexcept;
  [[nodiscard]] InsDevice& ins() noexcept;
  [[nodiscard]] TriggerDevice& trigger() noexcept;
  [[nodiscard]] const RigTruth& truth() const noexcept;
  /// Image memory in bytes, valid once the cameras are configured.
  [[nodiscard]] std::size_t image_bytes() const noexcept;

  /// Host time at the start of the drive, valid once the trigger was started (in virtual time
  /// always the same).
  [[nodiscard]] HostStamp start() const noexcept;
  /// Times of the pulses without pauses, on the host's clock since the start of the drive. Valid
  /// once the trigger is configured.
  [[nodiscard]] std::vector<Duration> pulse_times() const;
  /// Number of pulses of the whole drive at this rate.
  [[nodiscard]] std::uint64_t pulses(double rate_hz) const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vergence::mock
