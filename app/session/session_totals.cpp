#include "app/session/session_totals.hpp"

namespace vergence::app {

void BudgetStatistics::add(const FrameWorkload& effort) noexcept {
  if (effort.whole()) return;
  ++frames;
  const bool window = effort.window_keyframes > 0 && effort.window_steps > 0;
  points += effort.points_percent < 100 ? 1 : 0;
  keyframes += window && effort.window_keyframes != FrameWorkload::kAll ? 1 : 0;
  steps += window && effort.window_steps != FrameWorkload::kAll ? 1 : 0;
  windows += window ? 0 : 1;
}

void TotalsBuilder::add(const FrameReport& report) {
  const PoseSample& p = report.pose;
  newest_ = p.stamp;
  newest_frame_ = p.frame;
  ++totals_.read;
  match_verified();
  ++(p.status == PoseStatus::ok         ? totals_.ok
     : p.status == PoseStatus::degraded ? totals_.degraded
                                        : totals_.lost);
  totals_.estimate.add(static_cast<double>(p.estimate_ms));
  if (p.state != State::stereo_odometry && p.state != State::lost)
    totals_.calibrating.add(static_cast<double>(p.estimate_ms));
  totals_.decode.add(static_cast<double>(report.decode_ms));
  totals_.work_dropped.add(p.effort);
  for (std::size_t i = 0; i < p.stage_ms.size(); ++i)
    totals_.stages[i].add(static_cast<double>(p.stage_ms[i]));
  if (p.status == PoseStatus::lost) return;
  const Vec3& t = p.T_world_left.t;
  if (last_position_) {
    const Vec3 step = t - *last_position_;
    totals_.path_m += std::hypot(step.x(), step.y(), step.z());
  }
  last_position_ = t;
}

/// An event comes before the pose of its frame, or after the last one.
void TotalsBuilder::match_verified() {
  if (totals_.verified == newest_ && !totals_.verified_frame && totals_.read > 0)
    totals_.verified_frame = newest_frame_;
}

void TotalsBuilder::add(const EventRecord& e) {
  const std::string_view kind = e.kind;
  if (kind == "calibration_verified" && !totals_.verified) {
    totals_.verified = e.stamp;
    match_verified();
  } else if (kind == "calibration_contradicted" && !totals_.contradicted) {
    const double* percent = std::get_if<double>(&e.fields[0].value);
    totals_.contradicted = {e.stamp, percent != nullptr ? *percent : 0.0};
  }
}

bool CalibrationTotals::add(const CalibrationRecord& c) {
  if (c.focal.measured_px > 0) focal = c.focal;
  // A rejected refinement changes nothing, so it does not count as an attempt.
  if (c.is_refinement && !c.accepted) return false;
  ++(c.accepted ? accepted : rejected);
  if (attempts.size() == kMaxAttempts) attempts.erase(attempts.begin());
  const CalibrationAttempt attempt{c.stamp,          c.cause_name(),       c.reason,  c.accepted,
                                   c.latency_frames, c.calibration.frames, c.solve_ms};
  attempts.push_back(attempt);
  if (!from_scratch.found && attempt.cause == "from_scratch") {
    if (attempt.accepted)
      from_scratch.found = attempt;
    else
      ++from_scratch.rejected;
  }
  return c.accepted;
}

}  // namespace vergence::app
