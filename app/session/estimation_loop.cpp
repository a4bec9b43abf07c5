#include "app/session/estimation_loop.hpp"

#include <pthread.h>

#include "core/memory/allocation_guard.hpp"
#include "core/memory/thread_allocations.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

namespace {

/// Time budget of a frame: live, the next one does not wait.
Duration frame_budget(const SourceFacts& facts, const RealtimeSettings& realtime) noexcept {
  if (facts.frame_interval <= Duration{}) return {};
  return realtime.frame_budget_ms > 0 ? Duration::seconds(1e-3 * realtime.frame_budget_ms)
                                      : facts.frame_interval;
}

}  // namespace

EstimationLoop::EstimationLoop(FrameSource& source, const Configuration& configuration,
                               const SessionOptions& options)
    : source_(source),
      facts_(source.facts()),
      requests_(options.requests),
      reference_(facts_.truth),
      masks_(configuration, facts_.begin.file.rig),
      options_(estimator_options(configuration, facts_.begin.trust, facts_.adoption, masks_.views(),
                                 frame_budget(facts_, configuration.realtime))),
      runner_(make_runner(configuration.threads)),
      estimator_(std::make_unique<Estimator>(options_, facts_.begin.file.rig, facts_.begin.nominal,
                                             estimator_arena_, *runner_, watched_solver_)) {
  if (facts_.ins)
    comparison_ = std::make_unique<InsComparison>(facts_.ins->options, facts_.ins->kind,
                                                  comparison_arena_, log_);
}

void EstimationLoop::open(const SessionOutput& output, DriveRecorder* recording,
                          CalibrationWriter* calibrations) noexcept {
  output_ = output;
  recording_ = recording;
  calibrations_ = calibrations;
  log_.open(&output_, facts_.first);
  if (comparison_) comparison_->open(&output_);
}

void EstimationLoop::log_kept_calibrations() noexcept {
  for (CalibrationWriter::Outcome outcome; calibrations_->next(&outcome);)
    log_.log(outcome.event, outcome.failed);
}

bool EstimationLoop::next(SourceItem* item) noexcept {
  beat_.waiting.store(true, std::memory_order_relaxed);
  const bool got = source_.next(item);
  beat_.waiting.store(false, std::memory_order_relaxed);
  beat_.items.fetch_add(got ? 1 : 0, std::memory_order_relaxed);
  return got;
}

void EstimationLoop::run() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-estim");
  AllocationGuard::seal_thread();
  for (SourceItem item; next(&item);) {
    if (const auto* frame = std::get_if<SourceFrame>(&item)) handle(*frame);
    if (const auto* reading = std::get_if<InsRecord>(&item)) handle(*reading);
    if (const auto* event = std::get_if<SourceEvent>(&item)) handle(*event);
    if (comparison_) comparison_->drain();
  }
  ThreadAllocations::end();
  drained_.store(true, std::memory_order_release);
  estimator_->finish();
  log_.collect(*estimator_);
  if (comparison_) comparison_->finish();
  AllocationGuard::unseal_thread();
}

void EstimationLoop::handle(const SourceEvent& event) noexcept {
  if (event.recalibrate) estimator_->request_recalibration();
  if (event.skipped) ++counts_.skipped;
  if (event.listed) log_.log(event.record, event.to_user);
}

void EstimationLoop::request_recalibration(Stamp stamp, const char* message) noexcept {
  estimator_->request_recalibration();
  log_.log(stamp, "recalibration_requested", message, true);
}

/// Handles requests of viewers.
void EstimationLoop::poll_requests(Stamp stamp) noexcept {
  if (requests_ == nullptr) return;
  constexpr auto kOrder = std::memory_order_relaxed;
  if (requests_->recalibrate.exchange(false, kOrder) && facts_.on_request)
    request_recalibration(stamp, "a recalibration was requested on the live page");
  if (requests_->mark.exchange(false, kOrder))
    log_.log(stamp, "mark", "marked on the live page", true);
  if (requests_->stop_recording.exchange(false, kOrder) && recording_) {
    log_.log(stamp, "recording_stopped", "recording stopped on the live page; the run continues",
             true);
    recording_->stop();
  }
}

void EstimationLoop::handle(const SourceFrame& frame) noexcept {
  if (calibration_asked_.exchange(false, std::memory_order_relaxed))
    request_recalibration(frame.rig.stamp, "a recalibration was requested by SIGUSR1");
  poll_requests(frame.rig.stamp);
  log_kept_calibrations();
  if (!delivering_) ThreadAllocations::begin();
  delivering_ = true;
  watched_solver_.begin_frame(frame.solver_idle);
  output_.post(&SessionObserver::on_frame, frame.rig);
  const PoseSample sample = estimator_->process(frame.rig);
  source_.done(sample);
  const FrameReport posed = report(frame, sample);
  output_.post(&SessionObserver::on_pose, posed);
  output_.post(&SessionObserver::on_tracks, estimator_->tracks());
  log_.collect(*estimator_);
  log_.record_effort(sample);
  if (comparison_) return comparison_->add(posed);
  output_.post(&SessionObserver::on_report, posed);
  log_.collect(posed);
}

FrameReport EstimationLoop::report(const SourceFrame& frame, const PoseSample& sample) noexcept {
  const RigFrame& rig = frame.rig;
  if (newest_number_ && rig.number > *newest_number_ + 1)
    counts_.missing += rig.number - *newest_number_ - 1;
  newest_number_ = rig.number;
  ++counts_.read;
  ++(sample.status == PoseStatus::ok         ? counts_.ok
     : sample.status == PoseStatus::degraded ? counts_.degraded
                                             : counts_.lost);
  if (sample.status != PoseStatus::lost) {
    const Vec3& position = sample.T_world_left.t;
    if (newest_position_) counts_.path_m += (position - *newest_position_).norm();
    newest_position_ = position;
  }
  FrameReport r;
  r.pose = sample;
  r.counts = counts_;
  r.stamp_error = rig.stamp_error;
  r.spread = rig.spread;
  r.pairing = rig.pairing;
  r.cameras = rig.cameras;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    if (!rig.images[k].empty())
      r.images_present = static_cast<std::uint8_t>(r.images_present | 1U << k);
  r.estimated = monotonic_now();
  r.decode_ms = frame.decode_ms;
  if (!comparison_) r.T_reference_left = reference_.at(sample.stamp);
  return r;
}

}  // namespace vergence::app
