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
  bool real_time = false;  // false: virtual time, the producer waits for the consumer
  std::uint64_t seed = 1;
  Pattern pattern =
      Pattern::grey;  // gbrg: grey is made of the mosaic, as the drivers of colour cameras do
  bool raw = false;  // with gbrg: the cameras hand out the mosaic itself, for who writes a data set
  bool noise = true;  // shot and read noise of the sensors
  int blur_samples =
      1;  // poses averaged over an exposure: 1 is none; the time to render grows with it
  bool ideal_ins = false;
  double clock_drift_ppm = 30;  // largest of the devices' clocks; each has its own
  Duration duration{};          // of the drive; zero: all of it
  std::array<Duration, kMaxCameras>
      trigger_delay{};  // from a pulse's edge to the start of the exposure, by camera
  /// Virtual time: the consumer takes the board's reports, in the order of arrival. The board then
  /// runs no farther ahead of them than what decides at which pulse a pause begins: the fourth
  /// after the newest report taken, on every run.
  bool reports_read = false;
  /// Virtual time: who waits for camera 0 asks for the next image once the last is done with, and
  /// may set the exposure before. No image is then made while one is still looked at:
  /// set_exposure() acts at the same image on every run.
  bool exposures_follow = false;
};

/// A rig that does not exist: cameras, INS and trigger board behind the drivers' interfaces, on a
/// vehicle driving through a world.
///
/// The drive begins when the trigger is started (the cameras and the INS before it), with pulse 0
/// at the drive's time 0. Every device has a clock of its own, with offset and drift; arrivals have
/// a least delay and a jitter above it. Pulse n of a boot goes to every camera whose line is
/// pulsed; a camera's exposure starts `trigger_delay` later. With feedback wired the report has
/// every exposure in whole microseconds, its edge on the host's clock to 20 µs, and comes after the
/// last of them, or just before the next pulse where one never came.
/// Ownership  The devices live in the rig; it outlives their use.
/// Threads    Pictures are rendered on two threads of the rig's, one camera each; in real time
///            another hands them out when they are due.
/// Time       Virtual: arrivals are what they would be, nothing waits for a clock; items become
///            visible in the order of their arrivals over all devices, so that a consumer that
///            merges by arrival sees the same on every run. Real: a pulse that the renderer cannot
///            keep up with has no frames (Camera statistics `lost`), a frame that finds no slot is
///            dropped (`underruns`).
/// Errors     The constructor throws std::invalid_argument. The devices as their interfaces say.
class MockRig {
 public:
  static constexpr std::size_t kSlots =
      24;  // of each camera: the synchroniser's, the estimator's and the ones being rendered

  MockRig(std::shared_ptr<const RigTruth> truth, const MockRigOptions& options);
  ~MockRig();

  [[nodiscard]] int cameras() const noexcept;
  [[nodiscard]] CameraDevice& camera(int k) noexcept;
  [[nodiscard]] InsDevice& ins() noexcept;
  [[nodiscard]] TriggerDevice& trigger() noexcept;
  [[nodiscard]] const RigTruth& truth() const noexcept;
  /// Image memory, bytes; after the cameras are configured.
  [[nodiscard]] std::size_t image_bytes() const noexcept;

  /// The host's time at the drive's start; known once the trigger was started (virtual time: always
  /// the same).
  [[nodiscard]] HostStamp start() const noexcept;
  /// When the board pulses, pauses apart: since the drive's start, by the host's clock. After the
  /// trigger is configured.
  [[nodiscard]] std::vector<Duration> pulse_times() const;
  /// Pulses of the whole drive at this rate.
  [[nodiscard]] std::uint64_t pulses(double rate_hz) const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vergence::mock
