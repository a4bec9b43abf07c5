#include "app/session/event_log.hpp"

namespace vergence::app {
namespace {

// Number of frames without dropped work after which the next drop is reported again.
constexpr int kWholeAgain = 100;

/// Events printed immediately.
bool is_for_user(EstimatorEvent::Kind kind) noexcept {
  using Kind = EstimatorEvent::Kind;
  return kind == Kind::rig_changed || kind == Kind::rig_not_rigid || kind == Kind::out_of_sync ||
         kind == Kind::cameras_in_sync || kind == Kind::calibration_verified ||
         kind == Kind::calibration_contradicted || kind == Kind::focal_length_contradicted ||
         kind == Kind::calibration_accepted || kind == Kind::calibration_rejected ||
         kind == Kind::calibration_pending || kind == Kind::calibration_resumed;
}

std::string spaced(std::string_view name) {
  std::string text(name);
  std::ranges::replace(text, '_', ' ');
  return text;
}

/// `stereo`, `stereo, verifying the calibration`, `parallel monocular, needs motion`.
std::string describe_state(State state, Reason reason) {
  std::string text = state == State::stereo_odometry ? "stereo" : spaced(to_string(state));
  if (reason == Reason::unverified_calibration) text += ", verifying the calibration";
  if (reason == Reason::needs_motion || reason == Reason::needs_near_structure ||
      reason == Reason::needs_texture)
    text += ", " + spaced(to_string(reason));
  return text;
}

}  // namespace

void EventLog::open(SessionOutput* output, Stamp first) noexcept {
  output_ = output;
  first_ = first;
}

void EventLog::collect(const Estimator& estimator) noexcept {
  for (const EstimatorEvent& event : estimator.events()) {
    if (event.kind == EstimatorEvent::Kind::dropped)
      dropped_ += static_cast<std::uint64_t>(std::max(0.0, event.value));
    const EventRecord record = EventRecord::of(event);
    output_->post(&SessionObserver::on_event, record);
    if (is_for_user(event.kind)) (void)notices_.push(record);
  }
  for (const CalibrationDecision& decision : estimator.calibrations())
    output_->post(&SessionObserver::on_calibration, CalibrationRecord{decision});
}

/// Frames in a row without all of their work are one event.
void EventLog::record_effort(const PoseSample& sample) noexcept {
  if (sample.effort.whole()) {
    whole_frames_ = std::min(whole_frames_ + 1, kWholeAgain);
    return;
  }
  if (std::exchange(whole_frames_, 0) < kWholeAgain) return;
  EventRecord event(
      sample.stamp, "work_dropped",
      "frames take longer than the frame budget: work other than the pose is omitted");
  event.fields[0] = {"points_percent", std::int64_t{sample.effort.points_percent}};
  event.fields[1] = {"window_keyframes", std::int64_t{sample.effort.window_keyframes}};
  event.fields[2] = {"window_steps", std::int64_t{sample.effort.window_steps}};
  log(event);
}

void EventLog::log(const EventRecord& event, bool to_user) noexcept {
  output_->post(&SessionObserver::on_event, event);
  if (to_user) (void)notices_.push(event);
}

void EventLog::show(Progress* progress, std::uint64_t frames) {
  for (EventRecord notice; notices_.pop(&notice);)
    progress->print("vergence: at {:.1f} s {}", (notice.stamp - first_).to_seconds(),
                    notice.message.data());
  FrameReport newest;
  bool any = false;
  while (reports_.pop(&newest)) any = true;
  if (!any) return;
  ProgressState state{.state = describe_state(newest.pose.state, newest.pose.reason),
                      .frame = newest.counts.read + newest.counts.skipped,
                      .frames = frames,
                      .path_m = newest.counts.path_m,
                      .inliers = newest.pose.inliers,
                      .estimate_ms = static_cast<double>(newest.pose.estimate_ms)};
  if (newest.compared) state.from_ins_m = newest.error_enu.norm();
  progress->update(state);
}

}  // namespace vergence::app
