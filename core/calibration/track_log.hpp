#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

namespace vergence::calibration {

/// One track in one rig frame, in raw pixels.
struct LoggedObservation {
  std::uint32_t track = 0;
  /// Bit k is set if camera k saw the track.
  std::uint8_t cameras = 0;
  /// Standard deviation of one coordinate, in pixels.
  float sigma = 0;
  std::array<Eigen::Vector2f, kMaxCameras> raw{};

  [[nodiscard]] bool by(std::size_t k) const noexcept { return ((cameras >> k) & 1U) != 0; }
};

/// One rig frame of the log. `T_camera_left` is from the cameras' own poses if unlinked, else from
/// the calibration in use.
struct LoggedFrame {
  std::uint64_t number = 0;
  Stamp stamp{};
  Transform T_left_world{};
  std::array<Transform, kMaxCameras> T_camera_left{};
  /// True if T_camera_left was measured in this frame.
  bool unlinked = false;
  /// Root mean square residual of the frame's pose.
  double reprojection_px = 0;
  /// Number of tracks that support the pose in both cameras.
  int stereo = 0;
  std::span<LoggedObservation> observations;
};

/// Ring of the newest moving rig frames with their tracks, from which a calibration is solved.
///
/// If full, the oldest frame is dropped; observations of a frame beyond its capacity are left out.
/// Not thread-safe. Memory from the arena at construction.
class TrackLog {
 public:
  TrackLog(std::size_t frames, std::size_t observations, Arena& arena);

  /// Begins a new frame, which push() then fills. `frame.observations` is not read.
  void begin(const LoggedFrame& frame) noexcept;
  void push(const LoggedObservation& observation) noexcept;

  void clear() noexcept { size_ = 0; }
  void drop_before(std::uint64_t number) noexcept;
  /// Scales all poses about a point of the world, as the odometry scaled its world.
  void scale_about(const Vec3& centre, double factor) noexcept;
  /// Copies a frame of another log with its observations.
  void append(const LoggedFrame& frame) noexcept;
  /// Replaces the content by the newest frames of another log, as many as there is room for.
  void copy(const TrackLog& from) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  /// Frame i; 0 is the oldest.
  [[nodiscard]] LoggedFrame& frame(std::size_t i) noexcept { return frames_[slot(i)]; }
  [[nodiscard]] const LoggedFrame& frame(std::size_t i) const noexcept { return frames_[slot(i)]; }

 private:
  [[nodiscard]] std::size_t slot(std::size_t i) const noexcept {
    return (first_ + i) % frames_.size();
  }

  std::span<LoggedFrame> frames_;
  std::span<LoggedObservation> observations_;
  std::size_t capacity_;
  std::size_t first_ = 0, size_ = 0;
};

}  // namespace vergence::calibration
