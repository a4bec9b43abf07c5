#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/calibration/track_log.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/calibration.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// A point that the left camera followed, raw pixels, and where the right one saw it.
struct LivePoint {
  std::array<float, 2> left{}, right{};
  bool both = false;
};

/// One frame's images on their way to the live page: only when somebody has asked, only every
/// so many rows.
///
/// Threads  take_images(), take_points(): the estimator's, sealed, a few hundred microseconds when
///          a frame is wanted, one load of a flag when not. The rest: one other thread. A flag says
///          whose the memory is; nobody waits.
/// Memory   reserve(), before the first frame: two images' rows that are taken.
class LiveImages {
 public:
  static constexpr int kWidth = 480;  // px at most, of what is shown
  static constexpr std::size_t kPoints = 600;

  struct Picture {
    int width = 0, height = 0;  // of the camera's image
    int step = 1;               // image pixels to one that is shown
    std::size_t bytes = 0;
    std::vector<std::uint8_t> rows{};  // `taken` of every `step` rows
    int taken = 1;
  };

  void reserve(std::size_t image_bytes);

  void take_images(const RigFrame& frame) noexcept;
  void take_points(const RigFrame& frame, const calibration::TrackLog& tracks) noexcept;

  /// Asks for the next frame, if none is asked for or here.
  void want() noexcept;
  /// A frame is here and stays until done().
  [[nodiscard]] bool ready() const noexcept {
    return owner_.load(std::memory_order_acquire) == Owner::viewer;
  }
  void done() noexcept { owner_.store(Owner::nobody, std::memory_order_release); }
  [[nodiscard]] std::uint64_t frame() const noexcept { return frame_; }
  [[nodiscard]] std::span<const Picture, 2> pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::span<const LivePoint> points() const noexcept { return points_.span(); }

 private:
  enum class Owner : std::uint8_t { nobody, estimator, filling, viewer };

  std::atomic<Owner> owner_{Owner::nobody};
  std::uint64_t frame_ = 0;
  std::array<Picture, 2> pictures_{};
  FixedVector<LivePoint, kPoints> points_;
};

/// A small grey JPEG of it; empty: there is no picture.
[[nodiscard]] std::string thumbnail(const LiveImages::Picture& picture);

/// RFC 4648.
[[nodiscard]] std::string base64(std::string_view bytes);

/// What the page shows of a point: its depth by a calibration, or that the two observations are
/// not of one point by it.
struct JudgedPoint {
  float depth_m = 0;  // 0: not known
  bool rejected = false;
};

/// Precondition: at least two cameras. Farther from its epipolar line than kRejectedPx, or behind
/// the rig: rejected.
inline constexpr double kRejectedPx = 3.0;
[[nodiscard]] std::vector<JudgedPoint> judge_points(std::span<const LivePoint> points,
                                                    const RigCalibration& rig);

}  // namespace vergence::app
