#include "app/report/analysis.hpp"

#include <utility>

#include <fmt/format.h>

#include "app/report/svg.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/math/angle.hpp"
#include "core/math/robust.hpp"

namespace vergence::app::report {
namespace {

// Length in m of the segment that aligns the trajectory with its reference, as with the INS.
constexpr double kAlignment = 100.0;
constexpr double kPercent = 100.0;
// Maximum gap in frame intervals across which a line is drawn.
constexpr double kWideGap = 4.0;

void measure_time(const Session& s, Analysis* a) {
  std::vector<double> steps;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    a->time_s.push_back(seconds_between(s.frames.front().stamp, s.frames[i].stamp));
    if (i > 0) steps.push_back(a->time_s[i] - a->time_s[i - 1]);
  }
  a->breaks.assign(s.frames.size(), 0);
  if (steps.empty()) return;
  a->duration_s = a->time_s.back();
  a->interval_s = median(std::span(steps));
  for (std::size_t i = 1; i < s.frames.size(); ++i)
    a->breaks[i] = a->time_s[i] - a->time_s[i - 1] > kWideGap * a->interval_s ? 1 : 0;
}

/// Frames that only waited for the first verification of the calibration in use. What is not
/// confirmed later on, after a knock, is held against the drive.
void count_waiting(const Session& s, Analysis* a) {
  const auto confirmed = std::ranges::find(s.events, "calibration_verified", &Event::kind);
  const bool ever = confirmed != s.events.end();
  if (ever && !s.frames.empty())
    a->verified_s = std::clamp(
        seconds_between(s.frames.front().stamp, std::max(s.frames.front().stamp, confirmed->stamp)),
        0.0, a->duration_s);
  for (const Frame& f : s.frames) {
    if (f.status != PoseStatus::degraded || (ever && f.stamp > confirmed->stamp)) continue;
    if (f.reason != Reason::uncalibrated && f.reason != Reason::unverified_calibration) continue;
    ++a->waited;
    ++a->waited_by_reason[static_cast<std::size_t>(f.reason)];
  }
}

void count_frames(const Session& s, Analysis* a) {
  a->read = s.frames.size();
  for (const Frame& f : s.frames) {
    ++(f.status == PoseStatus::ok         ? a->ok
       : f.status == PoseStatus::degraded ? a->degraded
                                          : a->lost);
    if (f.status != PoseStatus::ok) ++a->by_reason[static_cast<std::size_t>(f.reason)];
  }
  a->skipped = static_cast<std::size_t>(
      std::clamp(number_at(s.summary, "frames.skipped").value_or(0.0), 0.0, 1e12));
  if (a->read > 0)
    a->ok_share = static_cast<double>(a->ok) / static_cast<double>(a->read + a->skipped);
}

/// Aligns the first kAlignment metres of the estimate with the reference: by their attitudes and
/// mean position, which a straight path determines, too.
Transform align_start(const MatchedTrajectories& m) {
  double stretch = 0;
  std::size_t n = 1;
  for (; n < m.reference.size() && stretch < kAlignment; ++n)
    stretch += (m.reference[n].T_world_body.t - m.reference[n - 1].T_world_body.t).norm();
  // The mean of rotations that lie close together is their summed quaternions.
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector4d q =
        quaternion(m.reference[i].T_world_body.R * m.estimate[i].T_world_body.R.transpose())
            .coeffs();
    sum += q.dot(sum) < 0 ? Eigen::Vector4d(-q) : q;
  }
  const Mat3 R = Eigen::Quaterniond(sum).normalized().toRotationMatrix();
  Vec3 shift = Vec3::Zero();
  for (std::size_t i = 0; i < n; ++i)
    shift += m.reference[i].T_world_body.t - R * m.estimate[i].T_world_body.t;
  return {R, shift / static_cast<double>(n)};
}

/// Axes of the picture for a world whose up is +z, or for a camera's, whose up is −y: x to the
/// right both times.
Point on_map(const Vec3& p, bool up_is_z) {
  return up_is_z ? Point{p.x(), p.y()} : Point{p.x(), p.z()};
}

/// Direction of view in the map, rad, as a compass counts: clockwise, here from up.
double view_angle(const Mat3& R, bool up_is_z) {
  const Point v = on_map(R.col(2), up_is_z);
  return std::atan2(v.x, v.y);
}

void compare_with_reference(const Session& s, const MatchedTrajectories& m, Analysis* a) {
  const Transform T_reference_world = align_start(m);
  const bool up_is_z = world_up(m.reference, BodyAxes::camera).z() > 0.5;
  std::size_t k = 0;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const Frame& f = s.frames[i];
    if (!f.posed) continue;
    const Transform T = T_reference_world * f.T_world_left;
    const Point estimate = on_map(T.t, up_is_z);
    a->estimate_x[i] = estimate.x, a->estimate_y[i] = estimate.y;
    while (k < m.estimate.size() && m.estimate[k].stamp < f.stamp) ++k;
    if (k == m.estimate.size() || m.estimate[k].stamp != f.stamp) continue;
    const Transform& R = m.reference[k].T_world_body;
    const Point reference = on_map(R.t, up_is_z);
    a->reference_x[i] = reference.x, a->reference_y[i] = reference.y;
    a->horizontal_m[i] = std::hypot(estimate.x - reference.x, estimate.y - reference.y);
    a->vertical_m[i] = up_is_z ? T.t.z() - R.t.z() : R.t.y() - T.t.y();
    a->heading_deg[i] =
        std::remainder(view_angle(T.R, up_is_z) - view_angle(R.R, up_is_z), 2 * std::numbers::pi) *
        kDegreesPerRadian;
  }
}

void add_reference(const Session& s, Analysis* a) {
  std::vector<StampedPose> estimate;
  for (const Frame& f : s.frames)
    if (f.posed) estimate.push_back({f.stamp, f.T_world_left});
  const MatchedTrajectories m = estimate.empty()
                                    ? MatchedTrajectories{}
                                    : associate(estimate, s.reference, EvaluationOptions{});
  if (m.estimate.empty()) {
    a->source_message =
        "No errors: the stamps of reference.tum and of the estimate do not overlap.";
    return;
  }
  a->source = ErrorSource::reference;
  a->source_message = fmt::format(
      "Errors against the reference trajectory. The estimate is aligned once, rigidly and without "
      "scale, over the first {:.0f} m; what grows after that is drift.",
      kAlignment);
  compare_with_reference(s, m, a);
}

void add_ins(const Session& s, Analysis* a) {
  a->map_is_enu = true;
  // After an interruption the trajectory is aligned with ENU again: its positions step there.
  bool placed = false, compared = false;
  for (const Event& e : s.events) {
    if (e.kind != "enu_alignment") continue;
    const auto next = std::ranges::lower_bound(s.frames, e.stamp, {}, &Frame::stamp);
    if (std::exchange(placed, true) && next != s.frames.end())
      a->map_breaks[static_cast<std::size_t>(next - s.frames.begin())] = 1;
  }
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const Frame& f = s.frames[i];
    if (f.placed) a->estimate_x[i] = f.enu[0], a->estimate_y[i] = f.enu[1];
    if (f.has_ins) a->reference_x[i] = f.ins[0], a->reference_y[i] = f.ins[1];
    if (!f.compared) continue;
    compared = true;
    a->horizontal_m[i] = std::hypot(f.error[0], f.error[1]);
    a->vertical_m[i] = f.error[2];
    a->heading_deg[i] = f.error_heading_deg;
  }
  if (!compared) {
    a->source_message = "No errors: no frame could be compared with the INS.";
    return;
  }
  a->source = ErrorSource::ins;
  a->source_message =
      "Errors against the INS after the ENU alignment; they include the INS's own errors, and step "
      "at every further event enu_alignment.";
}

void add_world(const Session& s, Analysis* a) {
  for (std::size_t i = 0; i < s.frames.size(); ++i)
    if (s.frames[i].posed) {
      const Point p = on_map(s.frames[i].T_world_left.t, false);
      a->estimate_x[i] = p.x, a->estimate_y[i] = p.y;
    }
}

void compare(const Session& s, Analysis* a) {
  for (auto* curve : {&a->horizontal_m, &a->vertical_m, &a->heading_deg, &a->estimate_x,
                      &a->estimate_y, &a->reference_x, &a->reference_y})
    curve->assign(s.frames.size(), kNone);
  const bool placed = std::ranges::any_of(s.frames, [](const Frame& f) { return f.placed; });
  const bool ins = std::ranges::any_of(s.frames, [](const Frame& f) { return f.has_ins; });
  if (placed) return add_ins(s, a);
  if (ins) {
    a->ins_unplaced = true;
    a->source_message = "No errors: the run has no ENU alignment with its INS.";
    return add_world(s, a);
  }
  if (!s.reference.empty()) add_reference(s, a);
  if (a->source != ErrorSource::none) return;
  if (a->source_message.empty())
    a->source_message = "No errors: no reference was available, so the drift is unknown.";
  add_world(s, a);
}

Analysis::Spread make_spread(const std::vector<double>& values) {
  Analysis::Spread s;
  double sum = 0;
  std::size_t n = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v * v;
    ++n;
    s.max = n == 1 ? std::abs(v) : std::max(s.max, std::abs(v));
    s.end = v;
  }
  if (n > 0) s.rms = std::sqrt(sum / static_cast<double>(n));
  return s;
}

void add_metrics(const Session& s, Analysis* a) {
  const auto metric = [&s](const char* name) {
    return number_at(s.summary, std::string("metrics.") + name);
  };
  a->scale = metric("scale"), a->ate_m = metric("ate_m"),
  a->rotation_deg_per_m = metric("rotation_error_deg_per_m");
  if (const auto e = metric("end_error_percent")) a->end_error = *e / kPercent;
  const auto far = metric("segment_error_percent"), near = metric("segment_error_short_percent");
  if (far || near) a->drift = far.value_or(near.value_or(0)) / kPercent;
  a->drift_message = far    ? "mean of all segments of 100 to 800 m"
                     : near ? "mean of all segments of 10 to 50 m"
                            : "";
}

/// Mean horizontal difference of the two ways over segments of one length, m; nothing when none is
/// that long.
std::optional<double> mean_difference(const MatchedTrajectories& m, const Mat3& R,
                                      const std::vector<double>& driven, double length) {
  constexpr std::size_t kStep = 10;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0, j = 0; i < driven.size(); i += kStep) {
    while (j < driven.size() && driven[j] < driven[i] + length) ++j;
    if (j == driven.size()) break;
    const Vec3 d = R * (m.estimate[j].T_world_body.t - m.estimate[i].T_world_body.t) -
                   (m.reference[j].T_world_body.t - m.reference[i].T_world_body.t);
    sum += std::hypot(d.x(), d.y());
    ++count;
  }
  return count > 0 ? std::optional(sum / static_cast<double>(count)) : std::nullopt;
}

/// Drift against an INS by positions alone, over the longest segments there are. KITTI's figure
/// would turn each segment by the INS's attitude at its start, whose degree of error alone is 1.7 %
/// of the distance; a receiver's metres weigh least on the longest.
void drift_by_positions(const Session& s, Analysis* a) {
  a->segment_error = a->drift;
  a->drift.reset();
  // Positions of both at the frames that have both, the INS's in enu.
  constexpr std::size_t kMaxPairs = 20'000;
  MatchedTrajectories m;
  for (std::size_t i = 0; i < s.frames.size(); i += 1 + s.frames.size() / kMaxPairs) {
    const Frame& f = s.frames[i];
    if (!f.posed || !f.has_ins) continue;
    m.estimate.push_back({f.stamp, f.T_world_left});
    m.reference.push_back({f.stamp, {Mat3::Identity(), Vec3(f.ins[0], f.ins[1], f.ins[2])}});
  }
  if (m.estimate.size() < 3) return;
  const Mat3 R = align(m.estimate, m.reference, AlignmentScale::one).R_reference_estimate;
  std::vector<double> driven{0};
  for (std::size_t i = 1; i < m.estimate.size(); ++i)
    driven.push_back(driven.back() +
                     (m.estimate[i].T_world_body.t - m.estimate[i - 1].T_world_body.t).norm());
  for (const double length : {800.0, 700.0, 600.0, 500.0, 400.0, 300.0, 200.0, 100.0}) {
    const auto difference = mean_difference(m, R, driven, length);
    if (!difference) continue;
    a->drift = *difference / length;
    a->drift_message =
        fmt::format("horizontal, over segments of {:.0f} m; includes the INS's own errors", length);
    return;
  }
}

}  // namespace

double seconds_between(Stamp from, Stamp to) noexcept {
  // Unsigned, because the difference of two signed stamps need not fit.
  return static_cast<double>(static_cast<std::uint64_t>(to.ns()) -
                             static_cast<std::uint64_t>(from.ns())) *
         1e-9;
}

Analysis analyse(const Session& session) {
  Analysis a;
  measure_time(session, &a);
  a.map_breaks = a.breaks;
  const Vec3* last = nullptr;
  for (const Frame& f : session.frames) {
    if (f.posed && last != nullptr) a.path_m += (f.T_world_left.t - *last).norm();
    if (f.posed) last = &f.T_world_left.t;
    a.distance_m.push_back(a.path_m);
  }
  count_frames(session, &a);
  count_waiting(session, &a);
  compare(session, &a);
  a.horizontal = make_spread(a.horizontal_m);
  a.vertical = make_spread(a.vertical_m);
  a.heading = make_spread(a.heading_deg);
  if (a.source == ErrorSource::none) return a;
  add_metrics(session, &a);
  if (a.source == ErrorSource::ins) drift_by_positions(session, &a);
  return a;
}

}  // namespace vergence::app::report
