#include "core/calibration/monitor.hpp"

#include <cmath>

#include "core/calibration/detail/change_detector.hpp"
#include "core/calibration/detail/monitor_residuals.hpp"
#include "core/math/robust.hpp"

namespace vergence::calibration {
namespace {

using Kind = MonitorResult::Kind;

Pinhole pinhole(const Intrinsics& lens) noexcept { return {lens.fx, lens.fy, lens.cx, lens.cy}; }

bool good(const Pinhole& k) noexcept {
  return k.fx > 0 && k.fy > 0 && std::isfinite(k.fx + k.fy + k.cx + k.cy);
}

}  // namespace

StereoPair stereo_pair(const RigCalibration& rig, std::size_t k) noexcept {
  return {rig.T_camera_left[k], pinhole(rig.intrinsics[0]), pinhole(rig.intrinsics[k])};
}

struct Monitor::Parts {
  /// Fits the frames' offsets θ_f from the reference by a constant and by exposures of the camera
  /// that are late by a fraction δ of the interval between frames.
  ///
  /// With T the transform of the camera, ω and v the rotation and translation of the left camera
  /// since the previous frame, a late camera sees T exp(−δ (ω, v)). To first order this changes θ
  /// by δ p, p = −(R ω, Bᵀ R v / |t|), B the tangent basis of moved_on_sphere(). A value.
  class ExposureOffset {
   public:
    /// `frame`: evidence about θ at `T_camera_left`.
    void add(const detail::Evidence& frame, const Transform& T_camera_left,
             const Transform& T_now_before) noexcept {
      const double length = T_camera_left.t.norm();
      Vec5 p;
      p << -(T_camera_left.R * log_so3(T_now_before.R)),
          -(tangent_basis(T_camera_left.t / length).transpose() *
            (T_camera_left.R * T_now_before.t)) /
              length;
      A_ += frame.A;
      g_ += frame.g;
      Ap_ += frame.A * p;
      pAp_ += p.dot(frame.A * p);
      pg_ += p.dot(frame.g);
      gain_ += detail::gain(frame.A, frame.g);
    }

    /// Returns δ if it explains most of what the constant does not, else 0.
    [[nodiscard]] double frames() const noexcept {
      const Cholesky<5> factor = detail::with_prior(A_);
      const double slope = pg_ - Ap_.dot(factor.solve(g_)),
                   square = pAp_ - Ap_.dot(factor.solve(Ap_)),
                   all = gain_ - g_.dot(factor.solve(g_));
      return slope * slope > kMajority * square * all ? slope / square : 0;
    }

   private:
    // Sums over frames; with θ_f = A⁻¹ g, `gain_` is the sum of θᵀ A θ.
    Mat5 A_ = Mat5::Zero();
    Vec5 g_ = Vec5::Zero(), Ap_ = Vec5::Zero();
    double pAp_ = 0, pg_ = 0, gain_ = 0;
  };

  void clear() noexcept {
    residuals.reset();
    windows.reset(options, covariance);
    offset = {};
    latest = MonitorResult{};
    collapsed = standing_over = 0;
  }

  MonitorResult update(const MonitorFrame& frame) noexcept {
    if (valid) {
      watch_collapse(frame);
      watch_matches(frame);
    }
    MonitorResult v = latest;
    v.offset_frames = offset.frames();
    if (v.kind == Kind::quiet) {
      v.evidence = {};
      v.onset_frame = frame.frame;
    }
    v.evidence.rotation_mrad = 1e3 * v.evidence.shift_px / pair.camera.fx;
    if (collapsed >= options.collapse_frames) {
      v.evidence = {};
      v.kind = Kind::collapse;
      v.onset_frame = collapsed_from;
    }
    return v;
  }

  void watch_collapse(const MonitorFrame& frame) noexcept {
    const bool missing = frame.expected_stereo >= options.collapse_expected &&
                         frame.found_stereo < options.collapse_share * frame.expected_stereo;
    if (missing && collapsed == 0) collapsed_from = frame.frame;
    // A frame without expected matches (night, a covered lens) does not count.
    if (missing)
      ++collapsed;
    else if (frame.expected_stereo >= options.collapse_expected)
      collapsed = 0;
  }

  void watch_matches(const MonitorFrame& frame) noexcept {
    // If most of the expected matches are missing, the few that are found are chance matches.
    const detail::StereoResiduals stereo = collapsed > 0
                                               ? detail::StereoResiduals{}
                                               : residuals.stereo(pair, frame, options.min_matches);
    if (!stereo.usable) return;
    if (!frame.moving) {
      watch_standing(frame, stereo);
      return;
    }
    standing_over = 0;
    windows.push(stereo);
    offset.add(stereo.evidence, pair.T_camera_left, frame.T_now_before);
    latest = windows.decide();
  }

  void watch_standing(const MonitorFrame& frame, const detail::StereoResiduals& stereo) noexcept {
    // Keep what moving frames have detected.
    if (latest.kind != Kind::quiet && standing_over < options.collapse_frames) return;
    latest.statistic = windows.single(stereo.evidence, stereo.spread_now);
    latest.evidence = {0.5 * latest.statistic, detail::shift_px(stereo.evidence), 0};
    if (latest.statistic > options.threshold) {
      if (standing_over++ == 0) standing_from = frame.frame;
    } else {
      standing_over = 0;
    }
    latest.kind = standing_over >= options.collapse_frames ? Kind::knock : Kind::quiet;
    latest.undecided = standing_over > 0 && standing_over < options.collapse_frames;
    latest.onset_frame = standing_from;
  }

  MonitorOptions options{};
  bool valid = false;
  StereoPair pair{};
  Mat5 covariance = Mat5::Zero();
  detail::MonitorResiduals residuals{};
  detail::ChangeDetector windows{};
  ExposureOffset offset{};
  MonitorResult latest{};
  int collapsed = 0, standing_over = 0;
  std::uint64_t collapsed_from = 0, standing_from = 0;
};

Monitor::Monitor(const MonitorOptions& options, Arena& arena) {
  parts_ = arena.make<Parts>(1, "monitor").data();
  parts_->options = options;
  parts_->clear();
}

bool Monitor::set_reference(const StereoPair& pair, const Mat6& covariance) noexcept {
  Parts& p = *parts_;
  const Transform& T = pair.T_camera_left;
  const double length = T.t.norm();
  p.valid =
      T.finite() && length > 0 && good(pair.left) && good(pair.camera) && covariance.allFinite();
  if (p.valid) {
    const Mat32 B = tangent_basis(T.t / length);
    p.pair = pair;
    Eigen::Matrix<double, 5, 6> back = Eigen::Matrix<double, 5, 6>::Zero();
    back.topLeftCorner<3, 3>().setIdentity();
    back.bottomRightCorner<2, 3>() = B.transpose() / length;
    p.covariance = back * covariance * back.transpose();
  }
  p.clear();
  return p.valid;
}

void Monitor::expect_scatter(double bias_px) noexcept { parts_->windows.expect_scatter(bias_px); }

void Monitor::reset() noexcept { parts_->clear(); }

MonitorResult Monitor::update(const MonitorFrame& frame) noexcept { return parts_->update(frame); }

}  // namespace vergence::calibration
