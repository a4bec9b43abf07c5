#pragma once
#include <array>
#include <vector>

#include "app/runtime/queue_thread.hpp"
#include "core/types/calibration.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/exposure/exposure_controller.hpp"

namespace vergence::app {

/// Counters of a run; exact after the last frame and settle().
struct ExposureCounters {
  /// Number of changes requested.
  std::uint64_t changes = 0;
  /// Refusals by a camera that was disconnected or failed.
  std::uint64_t refused = 0;
  /// Changes for which the cameras applied different values.
  std::uint64_t unequal = 0;
  /// Repeated requests, because a camera had another setting.
  std::uint64_t again = 0;
  /// True if a camera cannot be changed while streaming; the exposure then stays fixed.
  bool unsupported = false;
  /// Last requested setting.
  ExposureSetting newest{};
};

/// Controls exposure and gain of all cameras by the brightness of camera 0. The setting is common,
/// so that mid-exposures agree.
///
/// Each image of camera 0 is measured when it is taken, in some 10 µs. An own thread changes the
/// cameras, because a device may take seconds. Since that thread acts at a different image on every
/// run, in virtual time the cameras are changed immediately. The cameras must outlive it. One
/// caller of on_frame(), which does not allocate. Errors are counted.
class ExposureControl final : public FrameObserver {
 public:
  /// `mask` is that of camera 0, empty or of the images' size; used only here. Preconditions: valid
  /// options, at least one camera, all configured with `start` and `width` x `height`.
  ExposureControl(std::vector<CameraDevice*> cameras, int width, int height, const ImageView& mask,
                  const exposure::ExposureOptions& options, const ExposureSetting& start,
                  bool at_once);
  ~ExposureControl() override { settle(); }

  void on_frame(std::size_t k, const Frame& frame) noexcept override;
  /// Carries out a pending request and ends the thread. Called by the owner after the last frame;
  /// may be called twice.
  void settle() noexcept { thread_.stop(); }
  [[nodiscard]] ExposureCounters counters() const noexcept {
    return {changes_, refused_, unequal_, again_, unsupported_, controller_.setting()};
  }

 private:
  [[nodiscard]] bool is_without(std::size_t k, const Frame& frame) noexcept;
  void ask(const ExposureSetting& requested) noexcept;
  void set_all(const ExposureSetting& requested) noexcept;

  std::vector<CameraDevice*> cameras_;
  exposure::BrightnessMeter meter_;
  exposure::ExposureOptions options_;
  exposure::ExposureController controller_;
  const bool at_once_;

  // Used by the thread that waits for frames.

  // True while a requested change is not yet visible.
  bool asked_ = false;
  // Consecutive frames without the setting.
  std::array<int, kMaxCameras> frames_without_{};

  // Values applied by each camera. Used by the changing thread, and by others while no change is
  // pending.
  std::array<ExposureSetting, kMaxCameras> applied_{};
  std::atomic<bool> under_way_{false}, unsupported_{false};
  std::atomic<std::uint64_t> changes_{0}, refused_{0}, unequal_{0}, again_{0};
  // Has room, because only one request is pending at a time.
  QueueThread<ExposureSetting, 4> thread_{WhenFull::drop};
};

}  // namespace vergence::app
