#include "core/calibration/monitor.hpp"

#include <cmath>

#include "core/calibration/detail/change_detector.hpp"
#include "core/calibration/detail/exposure_offset.hpp"
#include "core/calibration/detail/monitor_residuals.hpp"

namespace vergence::calibration {
namespace {

using Kind = MonitorResult::Kind;
}  // namespace

struct Monitor::Parts {
  MonitorOptions options{};
  bool valid = false;
  Transform T_camera_left{};
  detail::Reference reference{};
  Mat5 covariance = Mat5::Zero();
  detail::MonitorResiduals residuals{};
  detail::ChangeDetector windows{};
  detail::ExposureOffset offset{};
  MonitorResult latest{};
  int collapsed = 0, standing_over = 0;
  std::uint64_t collapsed_from = 0, standing_from = 0;

  void clear() noexcept {
    residuals.reset();
    windows.reset(options, covariance);
    offset = {};
    latest = MonitorResult{};
    collapsed = standing_over = 0;
  }
  void watch_collapse(const MonitorFrame& frame) noexcept;
  void watch_matches(const MonitorFrame& frame) noexcept;
  void watch_standing(const MonitorFrame& frame, const detail::StereoResiduals& stereo) noexcept;
};

Monitor::Monitor(const MonitorOptions& options, Arena& arena) {
  parts_ = arena.make<Parts>(1, "monitor").data();
  parts_->options = options;
  parts_->clear();
}

bool Monitor::set_reference(const Transform& T_camera_left, const Pinhole& left,
                            const Pinhole& right, const Mat6& covariance) noexcept {
  Parts& p = *parts_;
  const double length = T_camera_left.t.norm();
  const auto good = [](const Pinhole& k) {
    return k.fx > 0 && k.fy > 0 && std::isfinite(k.fx + k.fy + k.cx + k.cy);
  };
  p.valid =
      T_camera_left.finite() && length > 0 && good(left) && good(right) && covariance.allFinite();
  if (p.valid) {
    const Mat32 B = tangent_basis(T_camera_left.t / length);
    p.T_camera_left = T_camera_left;
    p.reference = {EpipolarGeometry(T_camera_left), left, right};
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

void Monitor::Parts::watch_collapse(const MonitorFrame& frame) noexcept {
  const bool missing = frame.expected_stereo >= options.collapse_expected &&
                       frame.found_stereo < options.collapse_share * frame.expected_stereo;
  if (missing && collapsed == 0) collapsed_from = frame.frame;
  // A frame without expected matches (night, a covered lens) does not count.
  if (missing)
    ++collapsed;
  else if (frame.expected_stereo >= options.collapse_expected)
    collapsed = 0;
}

void Monitor::Parts::watch_matches(const MonitorFrame& frame) noexcept {
  // If most of the expected matches are missing, the few that are found are chance matches.
  const detail::StereoResiduals stereo =
      collapsed > 0 ? detail::StereoResiduals{}
                    : residuals.stereo(reference, frame, options.min_matches, frame.moving);
  if (!stereo.usable) return;
  if (!frame.moving) {
    watch_standing(frame, stereo);
    return;
  }
  standing_over = 0;
  windows.push(stereo);
  offset.add(stereo.evidence, T_camera_left, frame.T_now_before);
  latest = windows.decide();
}

void Monitor::Parts::watch_standing(const MonitorFrame& frame,
                                    const detail::StereoResiduals& stereo) noexcept {
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

MonitorResult Monitor::update(const MonitorFrame& frame) noexcept {
  Parts& p = *parts_;
  if (p.valid) {
    p.watch_collapse(frame);
    p.watch_matches(frame);
  }
  MonitorResult v = p.latest;
  v.threshold = p.options.threshold;
  v.offset_frames = p.offset.frames();
  if (v.kind == Kind::quiet) {
    v.evidence = {};
    v.onset_frame = frame.frame;
  }
  v.evidence.rotation_mrad = 1e3 * v.evidence.shift_px / p.reference.right.fx;
  if (p.collapsed >= p.options.collapse_frames) {
    v.evidence = {};
    v.kind = Kind::collapse;
    v.onset_frame = p.collapsed_from;
  }
  return v;
}

}  // namespace vergence::calibration
