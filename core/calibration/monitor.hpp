#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/geometry/observations.hpp"
#include "core/memory/arena.hpp"

namespace vergence::calibration {

/// Every number a user may change in `monitor:`; the configuration's schema has a row for each
/// field. What the defaults reach, and the commands that measured it: docs/monitor.md.
struct MonitorOptions {
  double threshold = 45.0;  // of the statistic that raises a knock or a drift; ≥ 80 h between false
                            // alarms, 20 … 500
  double bias_px = 0.02;  // px rms over the image: slow error of vertical differences that is
                          // overlooked at least, 0 … 1
  // The same with a calibration that was found from images and is confirmed, expected until it is
  // measured, 0 … 2.
  double found_bias_px = 0.12;
  double claimed_bias_px = 0.3;  // and with one that is given, 0 … 5
  int min_matches =
      30;  // stereo matches under which a frame measures nothing (`needs_texture`), 12 … 1000
  int short_window = 3;     // moving frames of the shortest window: large knocks, 1 … 10
  int long_window = 300;    // moving frames of the longest window: drift, 60 … 1800
  double lag_frames = 0.3;  // frames: smallest lag of a camera that is called one, 0.1 … 1
  double lag_sigmas =
      5.0;  // and how many sigmas it must stand out from every fixed transform, 3 … 20
  int collapse_frames =
      5;  // frames in a row without the expected matches that raise `collapse`, 2 … 60
  double collapse_share = 0.2;  // of the expected matches: fewer found is a collapse, 0.01 … 0.9
  int collapse_expected =
      40;  // matches that must be expected before their absence says anything, 10 … 1000
};

/// A point seen by the left camera and by camera k in one frame. Ideal pinhole pixels (distortion
/// removed), each camera's own K. Searched for in a band wide enough that the calibration in use
/// did not force the answer.
struct StereoObservation {
  Vec2 left, right;
  double sigma_px =
      0;  // of one coordinate, > 0; a common factor does not matter, the spread is measured
  std::uint32_t track = 0;  // the same number in every frame that sees the same point
};

/// A point that both cameras saw at an earlier frame (`before`) and see now. One `before` for all
/// tracks of a frame. A track serves about once in its life: MotionTrackBuilder takes care of it.
struct MotionTrack {
  Vec2 left_before, right_before, left_now, right_now;
  double sigma_px = 0;
  std::uint32_t track = 0;
};

/// What the monitor is shown of one frame. Views: they live until look() returns.
struct MonitorFrame {
  Stamp stamp{};
  std::uint64_t frame = 0;  // strictly increasing
  bool moving = false;      // false: the images repeat themselves, so their errors do not average
  std::span<const StereoObservation> stereo;
  std::span<const MotionTrack> motion;  // empty in most frames
  Transform T_now_previous{};  // left camera, from the frame before to this one, from the odometry
  std::uint64_t before = 0;    // number of that earlier frame
  Transform T_now_before{};    // left camera, from `before` to now; read with `motion` only
  Transform T_before_earlier{};  // T_now_previous as it was at `before`
  int expected_stereo =
      0;  // matches a good pair of images would give; 0 where either image is poor by itself
  int found_stereo = 0;  // matches there are
};

/// What the monitor says after one frame.
struct MonitorVerdict {
  enum class Kind : std::uint8_t {
    quiet,
    knock,        // the transform has changed at a moment
    drift,        // it has been changing steadily
    collapse,     // matches are expected and not there: too far off to be measured
    out_of_step,  // camera k exposes `lag_frames` frames late (negative: early); no fixed transform
                  // explains it
  };
  Kind kind = Kind::quiet;
  bool undecided = false;  // over the threshold, but not yet told what it is: at most a second
  double statistic = 0;    // largest of all windows
  double threshold = 0;    // what it is held against
  Vec6 offset = Vec6::Zero();  // true minus reference, (φ rad, τ m): R ← Exp(φ) R, t ← t + τ; since
                               // the onset, else of the longest window; first order
  Mat6 covariance = Mat6::Zero();  // of `offset`; rank 5, the length is not seen
  double lag_frames =
      0;  // best estimate over the longest window, frames; meaningless where lag_sigma is infinite
  double lag_sigma = 0;       // frames; infinite: not seen
  bool shows_no_lag = false;  // this frame moved so far that a lag of one frame that began since
                              // then would be over the threshold in it, and nothing is
  bool in_step = false;  // this frame's motion shows, with those since set_reference() or reset(),
                         // that there is no lag, and would show the last one that was found
  std::uint64_t onset_frame =
      0;  // knock, out_of_step: first frame of the changed rig; drift: where it began; else `frame`
  int frames_since_onset = 0;  // frames measured since then
  bool needs_motion = false;   // yaw is not known to 0.1° for want of motion
  bool needs_texture = false;  // too few stereo matches to measure by
};

/// Watches whether the transform of one further camera still is true (METHOD §4). One Monitor per
/// further camera.
///
/// Every frame the stereo matches give, through the distance to the epipolar line, a gradient g and
/// an information A of θ = (φ, α, β, κ): the five of moved_on_sphere() and the lag κ of camera k.
/// Points seen at two instants add what a pair cannot see (yaw): each pair of observations is a
/// point with its covariance, and the two must be one rigid motion apart, which is eliminated; the
/// part of the observations that speaks of the epipolar distance is not used again. Over a window
/// of frames
///
///     A = Σ A_f/μ,  g = Σ g_f/μ,  μ = λ + n b²/5σ²
///     statistic = gᵀ (A + A C A)⁻¹ g,  κ held at 0
///
/// λ: spread of whole tracks over the white one, measured. b: MonitorOptions::bias_px, or what is
/// measured; in residuals of motion it counts four times (two instants, along the baseline).
/// C: covariance of the reference.
///
/// The same against what the two minutes before the window have shown, whose covariance is smaller
/// than the reference's: small knocks. Windows of a few to several hundred moving frames; the
/// largest statistic counts. Standing frames are tested one by one, more strictly: their errors
/// stay.
///
///     Arena arena(Monitor::memory_needed(options));
///     Monitor monitor(options, arena);
///     if (!monitor.set_reference(T_right_left, left, right, covariance)) return;
///     const auto verdict = monitor.look(frame);  // each posed frame
///     if (verdict.kind != MonitorVerdict::Kind::quiet) recalibrate(verdict.onset_frame);
///
/// Memory   All of it from the arena in the constructor. look() allocates nothing.
/// Threads  One caller.
/// Time     Under 0.3 ms for 300 stereo matches and 200 motion tracks.
/// Errors   The constructor throws (std::invalid_argument with a sentence, std::length_error). What
///          is not a number is left out.
class Monitor {
 public:
  [[nodiscard]] static std::size_t memory_needed(const MonitorOptions& options) noexcept;
  Monitor(const MonitorOptions& options, Arena& arena);

  /// A new calibration in use: X_k = T_camera_left X_left; forgets everything seen. `covariance` of
  /// its left perturbation, noise only: what uncertain intrinsics do to a calibration shows in no
  /// residual, so the wide one would make the monitor blind.
  /// False: |t| is zero or something is not finite; then every look() is quiet.
  bool set_reference(const Transform& T_camera_left, const Pinhole& left, const Pinhole& right,
                     const Mat6& covariance) noexcept;

  /// How much stretches of a drive are expected to disagree, px rms over the image, until that is
  /// measured: what the lenses in use leave. Outlives set_reference() and reset(), as what was
  /// measured does; monitor.bias_px is the least, and all there is without this call.
  void expect_scatter(double bias_px) noexcept;

  [[nodiscard]] MonitorVerdict look(const MonitorFrame& frame) noexcept;

  /// Forgets what was seen (the scene was lost); the reference stays.
  void reset() noexcept;

  /// Moving frames in a row that measured something and agreed with the reference: what confirms a
  /// calibration from a file.
  [[nodiscard]] int frames_agreed() const noexcept;

 private:
  struct Parts;
  Parts* parts_;  // in the arena
};

}  // namespace vergence::calibration
