#pragma once
#include <cstdint>
#include <span>

#include "core/geometry/observations.hpp"
#include "core/memory/arena.hpp"
#include "core/types/change_evidence.hpp"

namespace vergence::calibration {

/// Options of `monitor:`; the configuration's schema has a row for each. docs/design.md describes
/// what the defaults achieve.
struct MonitorOptions {
  /// Value of the statistic that raises a knock or a drift, 20 … 500; the default gives at least 80
  /// h between false alarms.
  double threshold = 45.0;
  /// Minimum of the slowly varying error of vertical differences that is tolerated, px rms over the
  /// image, 0 … 1.
  double bias_px = 0.02;
  /// Expected value of that error until it is measured, for a calibration that was estimated from
  /// images and is verified, 0 … 2.
  double verified_bias_px = 0.12;
  /// Expected value of that error with an unverified calibration, 0 … 5.
  double unverified_bias_px = 0.3;
  /// Stereo matches below which a frame measures nothing (`needs_texture`), 12 … 1000.
  int min_matches = 30;
  /// Moving frames of the shortest window, which detects large knocks, 1 … 10.
  int short_window = 3;
  /// Moving frames of the longest window, which detects drift, 60 … 1800.
  int long_window = 300;
  /// Consecutive frames that raise a `collapse` (without the expected matches), or a knock at
  /// standstill (above the threshold), 2 … 60.
  int collapse_frames = 5;
  /// Share of the expected matches below which a frame counts towards a collapse, 0.01 … 0.9.
  double collapse_share = 0.2;
  /// Matches that must be expected before their absence counts, 10 … 1000.
  int collapse_expected = 40;
};

/// The left camera and camera k of a rig: X_k = T_camera_left X_left.
struct StereoPair {
  Transform T_camera_left{};
  Pinhole left{}, camera{};
};
[[nodiscard]] StereoPair stereo_pair(const RigCalibration& rig, std::size_t k) noexcept;

/// Normalised coordinates of a pixel.
[[nodiscard]] inline Vec2 ray(const Pinhole& k, const Vec2& pixel) noexcept {
  return {(pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy};
}
/// Pixel of a point in the camera's frame.
[[nodiscard]] inline Vec2 project(const Pinhole& k, const Vec3& p) noexcept {
  return {k.fx * p.x() / p.z() + k.cx, k.fy * p.y() / p.z() + k.cy};
}

/// A point seen by the left camera and camera k in one frame, in undistorted pixels of each
/// camera's own K. Its match was searched for in a band wide enough not to depend on the
/// calibration in use.
struct StereoObservation {
  Vec2 left, right;
  /// Standard deviation of one coordinate, > 0. A common factor has no effect, because the spread
  /// is measured.
  double sigma_px = 0;
  /// Number of the point, the same in all frames.
  std::uint32_t track = 0;
};

/// Input of one frame. The views must stay valid until update() returns.
struct MonitorFrame {
  /// Frame number; strictly increasing.
  std::uint64_t frame = 0;
  /// False at standstill, where images repeat and their errors do not average out.
  bool moving = false;
  std::span<const StereoObservation> stereo;
  /// Motion of the left camera since the previous frame, for MonitorResult::offset_frames.
  Transform T_now_before{};
  /// Number of matches that a good pair of images would give; 0 if either image is poor.
  int expected_stereo = 0;
  int found_stereo = 0;
};

/// Result of the monitor after one frame.
struct MonitorResult {
  /// Kind of change, in order of severity.
  enum class Kind : std::uint8_t {
    quiet,
    /// The transform has been changing steadily.
    drift,
    /// The transform has changed suddenly.
    knock,
    /// Expected matches are missing: the change is too large to be measured.
    collapse,
  };
  Kind kind = Kind::quiet;
  /// True if a single frame exceeds the threshold, which may be an outlier.
  bool undecided = false;
  /// Largest statistic of all windows.
  double statistic = 0;

  /// Fraction of a frame that the camera's images are late (negative: early), if that explains most
  /// of the changes since the reference was set; else 0.
  double offset_frames = 0;
  /// Evidence for a knock or a drift.
  ChangeEvidence evidence;
  /// First frame of the changed rig after a knock, start of a drift, else `frame`.
  std::uint64_t onset_frame = 0;
};

/// Tests whether the transform of one additional camera still holds.
///
/// The distances of a frame's stereo matches from their epipolar lines give a gradient g and an
/// information matrix A of θ = (φ, α, β), the five parameters of moved_on_sphere(). Over a window
/// of n matches
///
///     A = Σ A_f/μ,  g = Σ g_f/μ,  μ = λ + n b²/5σ²
///     statistic = gᵀ (A + A C A)⁻¹ g
///
/// λ is the measured inflation of the gradient's variance by errors correlated along tracks. b is
/// MonitorOptions::bias_px or the measured scatter. C is the covariance of the reference.
/// DisparityJumpDetector and solves detect the rotation that no epipolar line shows (yaw, for
/// cameras side by side).
///
/// A second test finds small knocks: it compares the window with the two minutes before it, whose
/// covariance is smaller than the reference's. Windows have a few to several hundred moving frames;
/// the largest statistic counts. Frames of a standing rig are tested one by one, because their
/// errors repeat, and several in a row must exceed the threshold.
///
///     Arena arena;
///     Monitor monitor(options, arena);
///     if (!monitor.set_reference(pair, covariance)) return;
///     const auto verdict = monitor.update(frame);  // each posed frame
///     if (verdict.kind != MonitorResult::Kind::quiet) recalibrate(verdict.onset_frame);
///
/// Memory   All of it from the arena in the constructor. update() allocates nothing.
/// Threads  One caller.
/// Time     Under 0.1 ms for 300 stereo matches.
/// Errors   None; values that are not finite are left out.
class Monitor {
 public:
  Monitor() = default;
  Monitor(const MonitorOptions& options, Arena& arena);

  /// Sets the calibration to test and clears all evidence.
  /// `covariance` is of its left perturbation (rad, m) by noise alone: errors of the intrinsics
  /// show in no residual, so the total covariance would make the monitor insensitive. Returns false
  /// if |t| is zero or a value is not finite; then every update() is quiet.
  bool set_reference(const StereoPair& pair, const Mat6& covariance) noexcept;

  /// Sets the scatter that lens errors are expected to cause between stretches of a run until it is
  /// measured, in px rms over the image; at least monitor.bias_px, the default. It survives
  /// set_reference() and reset(), as the measured scatter does.
  void expect_scatter(double bias_px) noexcept;

  [[nodiscard]] MonitorResult update(const MonitorFrame& frame) noexcept;

  /// Clears all evidence because the map was lost; the reference stays.
  void reset() noexcept;

 private:
  struct Parts;
  // Constructed in the arena.
  Parts* parts_ = nullptr;
};

}  // namespace vergence::calibration
