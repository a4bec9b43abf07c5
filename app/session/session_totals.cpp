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

void SessionTotals::add(const FrameReport& report) {
  const PoseSample& p = report.pose;
  newest_ = p.stamp;
  newest_frame_ = p.frame;
  FrameCounts::add(p);
  match_verified();
  estimate.add(static_cast<double>(p.estimate_ms));
  if (p.state != State::stereo_odometry && p.state != State::lost)
    calibrating.add(static_cast<double>(p.estimate_ms));
  decode.add(static_cast<double>(report.decode_ms));
  work_dropped.add(p.effort);
  for (std::size_t i = 0; i < p.stage_ms.size(); ++i)
    stages[i].add(static_cast<double>(p.stage_ms[i]));
}

void SessionTotals::add(const EventRecord& e) {
  const std::string_view kind = e.kind;
  if (kind == "calibration_verified" && !verified) {
    verified = e.stamp;
    match_verified();
  } else if (kind == "calibration_contradicted" && !contradicted) {
    const double* percent = std::get_if<double>(&e.fields[0].value);
    contradicted = {e.stamp, percent != nullptr ? *percent : 0.0};
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
