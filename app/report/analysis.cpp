#include "app/report/analysis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

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

void measure_distance(const Session& s, Analysis* a) {
  const Vec3* last = nullptr;
  for (const Frame& f : s.frames) {
    if (f.posed) {
      if (last != nullptr) a->path_m += (f.T_world_left.t - *last).norm();
      last = &f.T_world_left.t;
    }
    a->distance_m.push_back(a->path_m);
  }
}

/// The first time that the drive confirmed the calibration in use.
const Event* first_verification(const Session& s) {
  const auto found = std::ranges::find_if(
      s.events, [](const Event& e) { return e.kind == "calibration_verified"; });
  return found == s.events.end() ? nullptr : &*found;
}

/// Frames that only waited for that. What is not confirmed later on, after a knock, is held against
/// the drive.
void count_waiting(const Session& s, Analysis* a) {
  a->waited_by_reason.assign(s.reasons.size(), 0);
  const Event* confirmed = first_verification(s);
  if (confirmed != nullptr && !s.frames.empty())
    a->verified_s = std::clamp(
        seconds_between(s.frames.front().stamp, std::max(s.frames.front().stamp, confirmed->stamp)),
        0.0, a->duration_s);
  for (const Frame& f : s.frames) {
    if (f.status != PoseStatus::degraded || (confirmed != nullptr && f.stamp > confirmed->stamp))
      continue;
    constexpr std::array kWaits{Reason::uncalibrated, Reason::unverified_calibration};
    const std::string& reason = s.reasons[f.reason];
    if (std::ranges::none_of(kWaits, [&reason](Reason r) { return reason == to_string(r); }))
      continue;
    ++a->waited;
    ++a->waited_by_reason[f.reason];
  }
}

/// By the gaps of their numbers, of which no damaged one counts for more than there was time for.
std::size_t missing_frames(const Session& s, const Analysis& a) {
  if (!(a.interval_s > 0)) return 0;
  double missing = 0;
  for (std::size_t i = 1; i < s.frames.size(); ++i) {
    const std::int64_t before = s.frames[i - 1].number, number = s.frames[i].number;
    if (before < 0 || number <= before) continue;
    const double steps = std::round((a.time_s[i] - a.time_s[i - 1]) / a.interval_s);
    missing += std::max(0.0, std::min(static_cast<double>(number - before), steps) - 1);
  }
  return static_cast<std::size_t>(missing);
}

void count_frames(const Session& s, Analysis* a) {
  a->by_reason.assign(s.reasons.size(), 0);
  a->read = s.frames.size();
  for (const Frame& f : s.frames) {
    ++(f.status == PoseStatus::ok         ? a->ok
       : f.status == PoseStatus::degraded ? a->degraded
                                          : a->lost);
    if (f.status != PoseStatus::ok) ++a->by_reason[f.reason];
  }
  a->skipped = s.summary.is_object()
                   ? static_cast<std::size_t>(std::clamp(
                         number_at(s.summary, "frames.skipped").value_or(0.0), 0.0, 1e12))
                   : missing_frames(s, *a);
  if (a->read > 0)
    a->ok_share = static_cast<double>(a->ok) / static_cast<double>(a->read + a->skipped);
}

std::vector<StampedPose> posed_frames(const Session& s) {
  std::vector<StampedPose> poses;
  for (const Frame& f : s.frames)
    if (f.posed) poses.push_back({f.stamp, f.T_world_left});
  return poses;
}

/// The rotation that turns the estimate's bodies onto the reference's, on average: the quaternion
/// of the summed products, which lie close together at the start of a drive.
Mat3 mean_rotation(std::span<const StampedPose> estimate, std::span<const StampedPose> reference) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Vector4d q =
        quaternion(reference[i].T_world_body.R * estimate[i].T_world_body.R.transpose()).coeffs();
    sum += q.dot(sum) < 0 ? Eigen::Vector4d(-q) : q;
  }
  return Eigen::Quaterniond(sum).normalized().toRotationMatrix();
}

struct Laid {
  Transform T_reference_world{};
  // Length in m.
  double stretch = 0;
  bool by_rotations = false;
};

/// Lays the first kAlignment metres of the estimate on the reference.
Laid lay_on(const MatchedTrajectories& m) {
  Laid laid;
  std::size_t n = 1;
  for (; n < m.reference.size() && laid.stretch < kAlignment; ++n)
    laid.stretch += (m.reference[n].T_world_body.t - m.reference[n - 1].T_world_body.t).norm();
  const auto estimate = std::span(m.estimate).first(n), reference = std::span(m.reference).first(n);
  const Alignment fit = align(estimate, reference, AlignmentScale::one);
  laid.T_reference_world = {fit.R_reference_estimate, fit.t_reference_estimate};
  // Positions on a straight line, or all in one place, hold no rotation: the attitudes do.
  // Fraction of the segment's length.
  constexpr double kHeld = 0.02;
  laid.by_rotations = n < 3 || fit.roll_unobservable || fit.lateral_extent < kHeld * laid.stretch;
  if (!laid.by_rotations) return laid;
  const Mat3 R = mean_rotation(estimate, reference);
  Vec3 shift = Vec3::Zero();
  for (std::size_t i = 0; i < n; ++i)
    shift += reference[i].T_world_body.t - R * estimate[i].T_world_body.t;
  laid.T_reference_world = {R, shift / static_cast<double>(n)};
  return laid;
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

void compare_with_reference(const Session& s, const MatchedTrajectories& m, const Laid& laid,
                            bool up_is_z, Analysis* a) {
  std::size_t k = 0;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const Frame& f = s.frames[i];
    if (!f.posed) continue;
    const Transform T = laid.T_reference_world * f.T_world_left;
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
  const std::vector<StampedPose> estimate = posed_frames(s);
  const MatchedTrajectories m = estimate.empty()
                                    ? MatchedTrajectories{}
                                    : associate(estimate, s.reference, EvaluationOptions{});
  if (m.estimate.empty()) {
    a->source_message =
        "No errors: the stamps of reference.tum and of the estimate do not overlap.";
    return;
  }
  const Laid laid = lay_on(m);
  const bool up_is_z = world_up(m.reference, BodyAxes::camera).z() > 0.5;
  a->source = ErrorSource::reference;
  a->source_message = fmt::format(
      "Errors against the reference trajectory. The estimate is aligned once, rigidly and without "
      "scale, over the first {:.0f} m ({}); what grows after that is drift.",
      laid.stretch,
      laid.by_rotations
          ? "by attitudes and mean position, because the path is too straight for positions alone"
          : "by positions");
  compare_with_reference(s, m, laid, up_is_z, a);
}

/// Where the way broke off the drive is placed on the earth anew: its positions step there.
void find_alignments(const Session& s, Analysis* a) {
  std::vector<Stamp> stamps;
  for (const Event& e : s.events)
    if (e.kind == "enu_alignment") stamps.push_back(e.stamp);
  std::ranges::sort(stamps);
  a->realigned.assign(s.frames.size(), 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const std::size_t before = next;
    while (next < stamps.size() && stamps[next] <= s.frames[i].stamp) ++next;
    if (a->placed_s.empty()) {
      if (s.frames[i].placed) a->placed_s.push_back(a->time_s[i]);
    } else if (next > before) {
      a->realigned[i] = 1;
      a->placed_s.push_back(a->time_s[i]);
    }
  }
}

std::string alignment_text(const Analysis& a) {
  constexpr std::size_t kReported = 5;
  if (a.placed_s.size() < 2) return ", which is fitted at the start and then fixed";
  std::string words = fmt::format(", which was fitted {} times, at ", a.placed_s.size());
  for (std::size_t i = 0; i < std::min(kReported, a.placed_s.size()); ++i)
    words += (i > 0 ? ", " : "") + duration_text(a.placed_s[i], 0.1);
  return words + (a.placed_s.size() > kReported ? ", …" : "") +
         ", after interruptions: errors and positions step there";
}

void add_ins(const Session& s, Analysis* a) {
  a->map_is_enu = true;
  find_alignments(s, a);
  bool compared = false;
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
  a->source_message = "Errors against the INS after the ENU alignment" + alignment_text(*a) +
                      "; they include the INS's own errors.";
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

/// Positions of both at the frames that have both, the INS's in enu.
MatchedTrajectories positions_with_ins(const Session& s) {
  constexpr std::size_t kMaxPairs = 20'000;
  const std::size_t stride = 1 + s.frames.size() / kMaxPairs;
  MatchedTrajectories m;
  for (std::size_t i = 0; i < s.frames.size(); i += stride) {
    const Frame& f = s.frames[i];
    if (!f.posed || !f.has_ins) continue;
    m.estimate.push_back({f.stamp, f.T_world_left});
    m.reference.push_back({f.stamp, {Mat3::Identity(), Vec3(f.ins[0], f.ins[1], f.ins[2])}});
  }
  return m;
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
  const MatchedTrajectories m = positions_with_ins(s);
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
  measure_distance(session, &a);
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
