#include "core/estimator/background_solve.hpp"

#include <algorithm>
#include <chrono>

#include "core/calibration/gates.hpp"

namespace vergence {

BackgroundSolve::BackgroundSolve(const EstimatorOptions& options, const RigCalibration& given,
                                 std::size_t tracks, Arena& arena, BackgroundRunner& runner)
    : options_(options),
      given_(given),
      solver_(options.calibration, options.monitor, given.cameras, tracks, arena),
      focal_check_(options.calibration.intrinsics == calibration::IntrinsicsEstimation::full),
      runner_(runner),
      task_{this} {}

void BackgroundSolve::start(const calibration::TrackLog& log, const Request& request) noexcept {
  solver_.log().copy(log, log.size());
  request_ = request;
  if (request.prior != nullptr) {
    prior_ = *request.prior;
    request_.prior = &prior_;
  }
  running_ = true;
  discarded_ = false;
  frames_since_start_ = 0;
  next_decision_ = std::min(kMinForMean, options_.calibration.adopt_after);
  runner_.start(TaskRef(task_));
}

void BackgroundSolve::run() noexcept {
  calibration::RigSolveRequest request;
  request.rig = request_.rig;
  request.from_rig = !request_.for_new_rig;
  // The prior of the intrinsics is the initial calibration, not earlier results of these frames, so
  // that no measurement counts twice.
  request.given = &given_;
  request.known = request_.prior;
  solved_ = solver_.solve(request);
  focal_check_.measure(solver_, request, solved_);
}

bool BackgroundSolve::next_frame() noexcept {
  ++frames_since_start_;
  if (frames_since_start_ < next_decision_) return false;
  if (options_.adoption == Adoption::when_ready) return !runner_.busy();
  const auto begin = std::chrono::steady_clock::now();
  runner_.wait();
  waited_ms_ =
      std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return true;
}

bool BackgroundSolve::must_decide() const noexcept {
  return frames_since_start_ >= options_.calibration.adopt_after;
}

void BackgroundSolve::postpone() noexcept {
  next_decision_ = std::min(next_decision_ + kMinForMean, options_.calibration.adopt_after);
}

void BackgroundSolve::finish() noexcept {
  if (running_) runner_.wait();
}

}  // namespace vergence
