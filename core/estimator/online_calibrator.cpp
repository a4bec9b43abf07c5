#include "core/estimator/online_calibrator.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/calibration/posterior.hpp"

namespace vergence {
namespace {

using calibration::Gate;
using odometry::MapPoint;

constexpr double kMovedPixels =
    1.0;  // px, mean of the tracks since the last logged frame: less repeats the same errors
constexpr int kLeastHeldOut =
    12;  // frames after a snapshot, for the gates to have frames that were not in it
constexpr int kStillFrames =
    15;  // sought for so long without a new frame in the log: the rig stands
constexpr std::size_t kNewFrames = 5;  // at least, between two solves
constexpr int kMostDoublings = 4;      // of the frames between two solves
constexpr double kGrow = 1.3;          // at least, of the frames between two solves

std::size_t most_tracks(const EstimatorOptions& o) noexcept {
  return static_cast<std::size_t>(o.odometry.features);
}

}  // namespace

void OnlineCalibrator::SolveTask::operator()() const noexcept {
  OnlineCalibrator& c = *calibrator;
  calibration::RigSolveRequest request;
  request.rig = c.asked_;
  request.from_rig = c.from_rig_;
  c.solved_ = {};
  if (c.sought_ || c.options_.calibration.estimate_lenses == 0) {
    c.solved_.transforms = c.rig_solver_.solve(request);
    if (c.solved_.transforms.status == calibration::RigSolveStatus::ok) {
      request.rig.T_camera_left = c.solved_.transforms.rig.T_camera_left;
      request.from_rig = true;
    }
  }
  if (c.options_.calibration.estimate_lenses == 0) return;
  request.freedom = calibration::RigFreedom::lenses;
  request.given = &c.given_;  // what the frames have shown since must not be its own witness
  request.known = c.has_prior_ ? &c.prior_ : nullptr;
  c.solved_.lenses = c.rig_solver_.solve(request);
}

std::size_t OnlineCalibrator::memory_needed(const EstimatorOptions& o,
                                            const RigCalibration& rig) noexcept {
  const auto further = static_cast<std::size_t>(rig.cameras - 1);
  return calibration::TrackLog::memory_needed(static_cast<std::size_t>(o.calibration.max_frames),
                                              most_tracks(o)) +
         calibration::RigSolver::memory_needed(o.calibration, o.monitor, rig.cameras,
                                               most_tracks(o)) +
         further * (calibration::Monitor::memory_needed(o.monitor) +
                    calibration::MotionTrackBuilder::memory_needed(most_tracks(o)) +
                    calibration::DisparityJumpDetector::memory_needed(most_tracks(o))) +
         most_tracks(o) * sizeof(calibration::StereoObservation) + 2 * kCacheLine;
}

OnlineCalibrator::OnlineCalibrator(const EstimatorOptions& options, const RigCalibration& rig,
                                   const RigCalibration& nominal, Arena& arena,
                                   BackgroundRunner& solver)
    : options_(options),
      rig_(rig),
      nominal_(nominal),
      given_(rig),
      calibrated_(options.trust != CalibrationTrust::none),
      log_(static_cast<std::size_t>(options.calibration.max_frames), most_tracks(options), arena),
      rig_solver_(options.calibration, options.monitor, rig.cameras, most_tracks(options), arena),
      runner_(solver),
      task_{this} {
  for (int k = 1; k < rig.cameras; ++k) {
    monitors_[static_cast<std::size_t>(k)].emplace(options.monitor, arena);
    feeds_[static_cast<std::size_t>(k)].emplace(most_tracks(options), arena);
    jumps_[static_cast<std::size_t>(k)].emplace(most_tracks(options), arena);
  }
  stereo_ = BoundedVector<calibration::StereoObservation>(
      arena.make<calibration::StereoObservation>(most_tracks(options), "monitored matches"));
  if (!calibrated_) return;
  watch_calibration();
  for (std::size_t c = 1; c < static_cast<std::size_t>(rig_.cameras); ++c)
    jumps_[c]->set_reference(rig_.T_camera_left[c], pinhole(0), pinhole(c));
  begin_segment();
}

void OnlineCalibrator::use(const RigCalibration& rig, bool lenses) noexcept {
  rig_ = rig;
  calibrated_ = true;
  found_with_lenses_ = lenses;
  keep();
}

void OnlineCalibrator::keep() noexcept {
  relink_pending_ = true;
  watched_ = true;
  seeking_ = false;
  begin_segment();
}

void OnlineCalibrator::refine(const RigCalibration& rig) noexcept {
  rig_ = rig;
  found_with_lenses_ = options_.calibration.estimate_lenses != 0;
  relink_pending_ = true;
}

void OnlineCalibrator::begin_segment() noexcept {
  solved_frames_ = 0;
  logged_ = log_.size();
  wanted_ = static_cast<std::size_t>(options_.calibration.min_frames);
}

void OnlineCalibrator::begin_anew() noexcept {
  stale_ = solving_;
  log_.clear();
  begin_segment();
  for (auto& m : monitors_)
    if (m) m->reset();
}

void OnlineCalibrator::scene_lost() noexcept {
  any_ = false;
  watched_ = false;
  begin_anew();
  for (auto& f : feeds_)
    if (f) f->reset();
  for (auto& j : jumps_)
    if (j) j->reset();
}

double OnlineCalibrator::pixels_moved(const odometry::Map& map) const noexcept {
  double sum = 0;
  int n = 0;
  for (const MapPoint& p : map.points()) {
    if (!p.followed() || !p.logged || !p.now.by(0)) continue;
    sum += static_cast<double>((p.raw[0] - p.logged_at).norm());
    ++n;
  }
  constexpr int kEnough = 10;
  return n < kEnough ? std::numeric_limits<double>::infinity() : sum / n;
}

void OnlineCalibrator::log(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome,
                           const RigFrame& frame) noexcept {
  if (outcome.scale != 1.0) log_.scale_about(outcome.T_left_world.centre(), outcome.scale);
  ++frames_still_;
  if (!outcome.images_good || pixels_moved(odometry.map()) < kMovedPixels) return;
  calibration::LoggedFrame f;
  f.number = frame.number;
  f.stamp = frame.stamp;
  f.T_left_world = outcome.T_left_world;
  f.T_camera_left = odometry.rig().T_camera_left;
  f.unlinked = odometry.linked() == odometry::Link::unlinked;
  f.reprojection_px = outcome.reprojection_px;
  f.stereo = outcome.stereo_inliers;
  log_.begin(f);
  for (MapPoint& p : odometry.map().points()) {
    // A track is taken by what the left camera's pose says of it. Linked, the others' observations
    // are taken as they were found: the calibration in use must not choose its own witnesses.
    if (!p.followed() || !p.now.by(0)) continue;
    calibration::LoggedObservation s;
    s.track = p.id;
    s.cameras = f.unlinked ? p.now.cameras : p.in_images;
    s.sigma = p.now.sigma[0];
    s.raw = p.raw;
    log_.push(s);
    p.logged = true;
    p.logged_at = p.raw[0];
  }
  ++logged_;
  frames_still_ = 0;
}

void OnlineCalibrator::seek(CalibrationCause cause, std::uint64_t onset,
                            std::uint64_t now) noexcept {
  cause_ = cause;
  onset_ = onset;
  sought_since_ = now;
  seeking_ = true;
  verified_ = false;
  frames_still_ = 0;
  rejections_ = 0;
  gate_ = Gate::open;
  stale_ = solving_;
  change_believed_ = false;
  log_.drop_before(onset);
  begin_segment();
  any_ = false;
  relink_pending_ = false;
  T_camera_left_before_ = rig_.T_camera_left;
  for (std::size_t c = 1; c < static_cast<std::size_t>(rig_.cameras); ++c)
    jumps_[c]->set_reference(rig_.T_camera_left[c], pinhole(0), pinhole(c));
}

Reason OnlineCalibrator::missing() const noexcept {
  if (!seeking_) return Reason::none;
  if (frames_still_ > kStillFrames || gate_ == Gate::needs_motion) return Reason::needs_motion;
  return gate_ == Gate::needs_near_structure ? Reason::needs_near_structure : Reason::none;
}

bool OnlineCalibrator::can_solve() const noexcept {
  return (seeking_ || calibrated_) && !solving_ && logged_ >= wanted_ &&
         log_.size() >= static_cast<std::size_t>(options_.calibration.min_frames);
}

void OnlineCalibrator::start_solve() noexcept {
  rig_solver_.log().copy(log_, log_.size());
  solving_ = true;
  stale_ = false;
  sought_ = seeking_;
  frames_since_snapshot_ = 0;
  next_judgement_ = std::min(kLeastHeldOut, options_.calibration.adopt_after);
  solved_frames_ = log_.size();
  asked_ = rig_;
  from_rig_ = !seeking_;
  has_prior_ = any_learnt_;
  if (any_learnt_) {
    prior_ = learnt_;
    const double hours = (log_.frame(log_.size() - 1).stamp - learnt_.found).to_seconds() / 3600.0;
    // What was learnt before an outage is no witness that nobody knocked the rig in it.
    if (sought_ || !watched_)
      calibration::forget_transforms(&prior_);
    else
      calibration::let_drift(hours, options_.calibration, &prior_);
  }
  runner_.start(TaskRef(task_));
}

std::optional<CalibrationDecision> OnlineCalibrator::decide(Stamp stamp,
                                                            std::uint64_t number) noexcept {
  waited_ms_ = 0;
  if (!solving_) return std::nullopt;
  ++frames_since_snapshot_;
  if (frames_since_snapshot_ < next_judgement_) return std::nullopt;
  if (options_.adoption == Adoption::when_ready) {
    if (runner_.busy()) return std::nullopt;
  } else {
    const auto start = std::chrono::steady_clock::now();
    runner_.wait();
    waited_ms_ =
        std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count();
  }
  // What is sought is adopted as soon as the frames after it confirm it; it is rejected only when
  // more of them would not help. What is learnt beside a calibration in use waits for no more than
  // it is judged by.
  const bool final_judgement = frames_since_snapshot_ >= options_.calibration.adopt_after;
  if (sought_ && !outdated() && !final_judgement &&
      calibration::check_acceptance(question(sought_solution(false), false),
                                    options_.calibration) != Gate::open) {
    next_judgement_ = std::min(next_judgement_ + kLeastHeldOut, options_.calibration.adopt_after);
    return std::nullopt;
  }
  return judge(stamp, number, false);
}

std::optional<CalibrationDecision> OnlineCalibrator::decide_now(Stamp stamp,
                                                                std::uint64_t number) noexcept {
  if (!solving_) return std::nullopt;
  runner_.wait();
  return judge(stamp, number, true);
}

bool OnlineCalibrator::start_last_solve() noexcept {
  const bool more = seeking_ || log_.size() >= solved_frames_ + kNewFrames;
  if (solving_ || !more || log_.size() < static_cast<std::size_t>(options_.calibration.min_frames))
    return false;
  start_solve();
  return true;
}

std::optional<CalibrationDecision> OnlineCalibrator::judge(Stamp stamp, std::uint64_t number,
                                                           bool last) noexcept {
  solving_ = false;
  if (outdated()) return std::nullopt;
  return sought_ ? judge_sought(stamp, number, last) : judge_learnt(stamp, number, last);
}

calibration::AcceptanceInput OnlineCalibrator::question(const calibration::RigSolution& found,
                                                        bool last) const noexcept {
  calibration::AcceptanceInput q;
  q.solution = &found;
  q.nominal = &nominal_;
  q.in_use = calibrated_ ? &rig_ : nullptr;
  q.log = &log_;
  q.lenses = &found == &solved_.lenses;
  q.pixel_sigma = options_.odometry.pixel_sigma;
  q.may_have_changed = !change_believed_;
  q.window_full = last || static_cast<std::size_t>(found.frames) >=
                              static_cast<std::size_t>(options_.calibration.max_frames);
  return q;
}

CalibrationDecision OnlineCalibrator::begin_decision(
    Stamp stamp, std::uint64_t number, const calibration::RigSolution& found) const noexcept {
  CalibrationDecision d;
  d.stamp = stamp;
  d.cause = cause_;
  d.calibration = found.rig;
  d.latency_frames = static_cast<int>(number - sought_since_);
  d.onset_frame = onset_;
  d.lenses = &found == &solved_.lenses;
  d.held_out_after_px = calibration::held_out(log_, found.newest, found.rig).median_px;
  if (calibrated_) d.held_out_before_px = calibration::held_out(log_, found.newest, rig_).median_px;
  d.solve_ms = solved_.transforms.solve_ms + solved_.lenses.solve_ms;
  return d;
}

CalibrationDecision OnlineCalibrator::judge_sought(Stamp stamp, std::uint64_t number,
                                                   bool last) noexcept {
  const auto most = static_cast<std::size_t>(options_.calibration.max_frames);
  const calibration::RigSolution& found = sought_solution(last);
  gate_ = calibration::check_acceptance(question(found, last), options_.calibration);
  CalibrationDecision d = begin_decision(stamp, number, found);
  d.accepted = gate_ == Gate::open;
  d.reason = calibration::reason(gate_);
  assess_lenses(found.rig, found.newest, &d);
  if (gate_ == Gate::open) {
    verified_ = d.verified;
    ever_verified_ = ever_verified_ || verified_;
  } else if (gate_ == Gate::sigmas_too_large || gate_ == Gate::needs_motion ||
             gate_ == Gate::needs_near_structure) {
    // More of the same helps: sigmas fall with the root of the number of frames.
    const double excess = gate_ == Gate::sigmas_too_large
                              ? calibration::sigma_excess(found.rig, options_.calibration)
                              : 1.0;
    const double grow = std::clamp(excess * excess, kGrow, 4.0);
    wanted_ = std::max(std::min(most, static_cast<std::size_t>(std::ceil(grow * found.frames))),
                       logged_ + kNewFrames);
  } else if (gate_ == Gate::rig_changed) {
    log_.drop_before(found.changed_at);
    onset_ = found.changed_at;
    change_believed_ = true;
    begin_segment();
  } else {
    // The same frames would say the same again; and what is rejected again and again is asked about
    // less and less often.
    log_.drop_before(found.newest + 1);
    wanted_ = logged_ - log_.size() +
              (static_cast<std::size_t>(options_.calibration.min_frames)
               << std::min(rejections_, kMostDoublings));
    ++rejections_;
  }
  return d;
}

/// The drive's own measurement of the rig, with the lenses free where they are not believed,
/// against what will be in use after this decision.
void OnlineCalibrator::assess_lenses(const RigCalibration& in_use_then, std::uint64_t newest,
                                     CalibrationDecision* d) const noexcept {
  const calibration::RigSolution& measured =
      options_.calibration.estimate_lenses != 0 ? solved_.lenses : solved_.transforms;
  if (measured.status != calibration::RigSolveStatus::ok) return;
  const calibration::Assessment then = calibration::assess(
      measured.rig, in_use_then, log_, newest, options_.calibration, options_.odometry.pixel_sigma);
  d->judged_depth_m = then.depth_m;
  d->depth_sigma_percent = then.sigma_percent;
  d->verified = then.confirmed;
  if (!calibrated_) return;
  d->depth_difference_percent =
      calibration::assess(measured.rig, rig_, log_, newest, options_.calibration,
                          options_.odometry.pixel_sigma)
          .difference_percent;
}

const calibration::RigSolution& OnlineCalibrator::sought_solution(bool last) const noexcept {
  return lenses_are_off(last) ? solved_.lenses : solved_.transforms;
}

bool OnlineCalibrator::lenses_are_off(bool last) const noexcept {
  const calibration::RigSolution &free = solved_.lenses, &held = solved_.transforms;
  if (free.status != calibration::RigSolveStatus::ok) return false;
  calibration::AcceptanceInput q = question(free, last);
  q.must_be_better = false;
  if (calibration::check_acceptance(q, options_.calibration) != Gate::open) return false;
  return held.status != calibration::RigSolveStatus::ok ||
         calibration::fits_better(log_, free.newest, free.rig, held.rig);
}

/// The claim in use is confirmed, or is no more: the monitor expects as much of it.
void OnlineCalibrator::set_verified(bool verified) noexcept {
  if (verified == verified_) return;
  verified_ = verified;
  ever_verified_ = ever_verified_ || verified;
  watch_calibration();
}

CalibrationDecision OnlineCalibrator::judge_learnt(Stamp stamp, std::uint64_t number,
                                                   bool last) noexcept {
  const auto most = static_cast<std::size_t>(options_.calibration.max_frames);
  const bool lenses = options_.calibration.estimate_lenses != 0;
  const calibration::RigSolution& found = lenses ? solved_.lenses : solved_.transforms;
  calibration::AcceptanceInput q = question(found, last);
  q.must_be_better = false;
  gate_ = calibration::check_acceptance(q, options_.calibration);
  CalibrationDecision d = begin_decision(stamp, number, found);
  d.cause = CalibrationCause::refinement;
  d.learnt = true;
  if (found.status == calibration::RigSolveStatus::ok) {
    const calibration::Assessment a = calibration::assess(
        found.rig, rig_, log_, found.newest, options_.calibration, options_.odometry.pixel_sigma);
    d.judged_depth_m = a.depth_m;
    d.depth_sigma_percent = a.sigma_percent;
    d.depth_difference_percent = a.difference_percent;
    if (a.contradicted) d.cause = CalibrationCause::contradicted;
    // Without a frame that was not used, more frames of the same kind are better and another kind
    // is not.
    const bool better = last && log_.frame(log_.size() - 1).number == found.newest
                            ? found_with_lenses_ == d.lenses
                            : a.better;
    if (gate_ == Gate::open && !better && !(a.contradicted && !a.worse)) gate_ = Gate::no_better;
    // Frames that contradict what was measured before them confirm nothing.
    d.verified = gate_ == Gate::open
                     ? a.sigma_percent <= options_.calibration.tolerated_depth_percent
                     : a.confirmed && gate_ != Gate::does_not_fit;
    if (d.verified || a.contradicted) set_verified(d.verified);
    watched_ = watched_ || d.verified;
  }
  d.accepted = gate_ == Gate::open;
  d.reason = calibration::reason(gate_);
  // A full segment is closed: what it told is the next one's prior. So is one that the frames
  // after it contradict: they are of another rig, and not to be solved with it.
  const bool usable = gate_ == Gate::open || gate_ == Gate::no_better;
  if (gate_ == Gate::does_not_fit) {
    log_.drop_before(found.newest + 1);
    begin_segment();
  } else if (solved_frames_ >= most) {
    if (usable) {
      learnt_ = found.rig;
      any_learnt_ = true;
    }
    log_.drop_before(found.newest + 1);
    begin_segment();
    wanted_ = most;
  } else {
    wanted_ = std::min(
        most, std::max(solved_frames_ + static_cast<std::size_t>(options_.calibration.min_frames),
                       logged_));
  }
  return d;
}

}  // namespace vergence
