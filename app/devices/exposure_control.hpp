#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "core/memory/ring.hpp"
#include "core/types/calibration.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/camera.hpp"
#include "drivers/common/wake_event.hpp"
#include "drivers/exposure/brightness.hpp"
#include "drivers/exposure/exposure_controller.hpp"

namespace vergence::app {

/// Counters of a run; exact after the last frame and settle().
struct ExposureCounters {
  std::uint64_t changes = 0;  // asked of the cameras
  std::uint64_t refused = 0;  // by a camera that was gone, or could not
  std::uint64_t unequal = 0;  // the cameras took different ones
  std::uint64_t again = 0;    // asked once more: a camera had another than it was given
  bool unsupported =
      false;  // a camera cannot be asked while it streams: nothing is changed any more
  ExposureSetting newest{};  // wanted last
};

/// Exposure and gain of all cameras of a rig from how bright camera 0's images are; the same for
/// all, so that their mid-exposures agree.
///
/// Each image of camera 0 is measured when the acquisition takes it, some 10 µs; what is to change
/// is asked of the cameras by a thread of its own, because a device may take seconds to answer.
/// That thread would come at another image on every run: in virtual time the cameras are asked at
/// once.
/// Ownership  The cameras outlive it. Threads: on_frame(), one caller; a thread of its own.
/// Memory     At construction; none in on_frame(). Errors: counted.
class ExposureControl final : public FrameObserver {
 public:
  /// `mask` of camera 0, read here only; it has the images' size or is empty. Preconditions: valid
  /// options, at least one camera, all of them configured with `start` and `width` x `height`.
  ExposureControl(std::vector<CameraDevice*> cameras, int width, int height, const ImageView& mask,
                  const exposure::ExposureOptions& options, const ExposureSetting& start,
                  bool at_once);
  ~ExposureControl() override;
  ExposureControl(const ExposureControl&) = delete;
  ExposureControl& operator=(const ExposureControl&) = delete;

  void on_frame(std::size_t k, const Frame& frame) noexcept override;
  /// Ends the thread. Owner, after the last frame; twice is harmless.
  void settle() noexcept;
  [[nodiscard]] ExposureCounters counters() const noexcept;

 private:
  [[nodiscard]] bool is_without(std::size_t k, const Frame& frame) noexcept;
  void ask(const ExposureSetting& requested) noexcept;
  void set_all(const ExposureSetting& requested) noexcept;
  void work() noexcept;

  std::vector<CameraDevice*> cameras_;
  exposure::BrightnessMeter meter_;
  exposure::ExposureOptions options_;
  exposure::ExposureController controller_;
  const bool at_once_;

  // Used by the thread that waits for frames.
  bool asked_ = false;                             // and not yet seen as done
  std::array<int, kMaxCameras> frames_without_{};  // in a row

  std::array<ExposureSetting, kMaxCameras>
      taken_{};  // as each camera rounded; of who asks, of the others while nothing is under way
  Ring<ExposureSetting, 4> requests_;
  std::atomic<bool> under_way_{false}, stop_{false}, unsupported_{false};
  std::atomic<std::uint64_t> changes_{0}, refused_{0}, unequal_{0}, again_{0};
  WakeEvent wake_;
  std::thread thread_;
};

}  // namespace vergence::app
