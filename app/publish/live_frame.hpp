#pragma once
#include <cstdint>
#include <optional>

#include "app/session/session_observer.hpp"
#include "core/comparison/comparison.hpp"
#include "core/comparison/enu_alignment.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

/// Where the odometry's world lies on the earth.
struct PublishedEnuAlignment {
  EnuAlignment alignment{};
  Geodetic origin{};  // of enu

  [[nodiscard]] EnuPose of(const Transform& T_world_left) const;
};

/// One frame for viewers and readers, with what has been counted up to it: figures stay true when
/// frames are left out.
struct LiveFrame {
  PoseSample pose{};
  HostStamp out{};  // when the estimator was done
  std::uint64_t read = 0, ok = 0, degraded = 0, lost = 0;
  std::uint64_t missing = 0;  // numbers of frames that never came
  double path_m = 0;
  Duration stamp_error{}, spread{};
  Pairing pairing = Pairing::assumed;
  int cameras = 0;
  std::uint8_t images_present = 0;  // mask by camera
  double age_ms = -1;               // from mid-exposure to the pose; negative: not known
};

/// `assumed`, `verified`, `contradicted`.
[[nodiscard]] const char* to_text(Pairing pairing) noexcept;

/// Counts a drive's frames and poses into the LiveFrame of each. One thread; no heap.
class LiveFrameBuilder {
 public:
  /// `tie`: without one ages are not known.
  void begin(const std::optional<ClockTie>& tie) noexcept { tie_ = tie; }
  /// The frame that the next pose is of; its images live as long as the caller's.
  void add(const RigFrame& frame) noexcept;
  /// Its pose, made at `now`.
  [[nodiscard]] const LiveFrame& add(const PoseSample& sample, HostStamp now) noexcept;
  [[nodiscard]] const RigFrame& frame() const noexcept { return frame_; }

 private:
  std::optional<ClockTie> tie_{};
  RigFrame frame_{};
  bool any_ = false;
  LiveFrame now_{};
  std::optional<Vec3> last_position_;
};

}  // namespace vergence::app
