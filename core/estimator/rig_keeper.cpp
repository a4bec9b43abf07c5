#include "core/estimator/rig_keeper.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vergence {
namespace {

using calibration::Gate;
using calibration::MonitorVerdict;
using odometry::MapPoint;

constexpr double kMovedPixels = 1.0;   // px, mean of the tracks since the last logged frame: less repeats the same errors
constexpr double kImageMargin = 12.0;  // px: nearer to the edge a track need not be found
// Sigmas taken for a calibration that says none: of rotation (rad), and of t in baselines. At first yaw and t_z are known by what a single
// pair sees of them, and that is what a lens model's misfit looks like too.
constexpr std::array kGivenAtFirst = {5e-4, 1e-2, 1e-3, 0.015, 0.01, 0.05};
constexpr std::array kGiven = {5e-4, 2e-3, 1e-3, 0.015, 0.01, 0.03};
constexpr double kLearnedCovariance = 1.5;  // times the monitor's own: the scene it was measured in was one
constexpr int kGraceFrames = 5;             // after a new reference: the monitor does not yet know how far matches spread
constexpr int kLearnFrames = 45;            // moving, in agreement
constexpr int kLeastHeldOut = 10;           // frames after a snapshot, for the gates to have frames that were not in it
constexpr int kStillFrames = 15;            // sought for so long without a new frame in the log: the rig stands
constexpr std::size_t kNewFrames = 5;       // at least, between two solves
constexpr int kMostDoublings = 4;           // of the frames between two solves
constexpr double kGrow = 1.3;               // at least, of the frames between two solves

std::size_t most_tracks(const EstimatorOptions& o) noexcept { return static_cast<std::size_t>(o.odometry.features); }

Mat6 given_covariance(const std::array<double, 6>& sigma, double baseline) noexcept {
  Vec6 spread = Eigen::Map<const Vec6>(sigma.data());
  spread.tail<3>() *= baseline;
  return spread.cwiseAbs2().asDiagonal();
}

int rank(MonitorVerdict::Kind kind) noexcept {
  using K = MonitorVerdict::Kind;
  switch (kind) {
    case K::quiet:
      return 0;
    case K::out_of_step:
      return 1;
    case K::drift:
      return 2;
    case K::knock:
      return 3;
    case K::collapse:
      return 4;
  }
  return 0;
}

}  // namespace

void RigKeeper::SolveTask::operator()() const noexcept { keeper->solution_ = keeper->rig_solver_.solve(keeper->rig_); }

std::size_t RigKeeper::memory_needed(const EstimatorOptions& o, const RigCalibration& rig) noexcept {
  const auto further = static_cast<std::size_t>(rig.cameras - 1);
  return calibration::TrackLog::memory_needed(static_cast<std::size_t>(o.calibration.max_frames), most_tracks(o)) +
         calibration::RigSolver::memory_needed(o.calibration, o.monitor, rig.cameras, most_tracks(o)) +
         further * (calibration::Monitor::memory_needed(o.monitor) + calibration::MonitorFeed::memory_needed(most_tracks(o))) +
         most_tracks(o) * sizeof(calibration::AcrossSighting) + 2 * kCacheLine;
}

RigKeeper::RigKeeper(const EstimatorOptions& options, const RigCalibration& rig, const RigCalibration& nominal, Arena& arena,
                     BackgroundRunner& solver)
    : options_(options),
      rig_(rig),
      nominal_(nominal),
      calibrated_(options.trust != CalibrationTrust::none),
      log_(static_cast<std::size_t>(options.calibration.max_frames), most_tracks(options), arena),
      rig_solver_(options.calibration, options.monitor, rig.cameras, most_tracks(options), arena),
      runner_(solver),
      task_{this} {
  for (int k = 1; k < rig.cameras; ++k) {
    monitors_[static_cast<std::size_t>(k)].emplace(options.monitor, arena);
    feeds_[static_cast<std::size_t>(k)].emplace(most_tracks(options), arena);
  }
  across_ = BoundedVector<calibration::AcrossSighting>(arena.make<calibration::AcrossSighting>(most_tracks(options), "monitored matches"));
  if (calibrated_) use(rig);
}

void RigKeeper::use(const RigCalibration& rig) noexcept {
  rig_ = rig;
  calibrated_ = true;
  for (int k = 1; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const auto& sigma = rig_.sigma_noise[c];
    learning_[c] = std::all_of(sigma.begin(), sigma.end(), [](double v) { return v == 0; });
    Mat6 covariance = given_covariance(kGivenAtFirst, rig_.T_camera_left[c].t.norm());
    if (!learning_[c]) covariance = Eigen::Map<const Vec6>(sigma.data()).cwiseAbs2().asDiagonal();
    watch_against(k, rig_.T_camera_left[c], covariance);
  }
  any_ = false;
  seeking_ = false;
  log_.clear();
}

void RigKeeper::watch_against(int k, const Transform& T_camera_left, const Mat6& covariance) noexcept {
  const auto pinhole = [&](std::size_t c) {
    const Intrinsics& lens = rig_.intrinsics[c];
    return Pinhole{lens.fx, lens.fy, lens.cx, lens.cy};
  };
  const auto c = static_cast<std::size_t>(k);
  (void)monitors_[c]->set_reference(T_camera_left, pinhole(0), pinhole(c), covariance);
  feeds_[c]->reset();
  grace_[c] = kGraceFrames;
}

void RigKeeper::learn(int k, MonitorVerdict* verdict) noexcept {
  const auto c = static_cast<std::size_t>(k);
  if (!learning_[c] || verdict->kind != MonitorVerdict::Kind::quiet || monitors_[c]->frames_agreed() < kLearnFrames) return;
  learning_[c] = false;
  const double length = rig_.T_camera_left[c].t.norm();
  const Mat6 together = given_covariance(kGiven, length) + verdict->covariance;
  if (verdict->offset.dot(together.ldlt().solve(verdict->offset)) > verdict->threshold) {
    verdict->kind = MonitorVerdict::Kind::knock;
    return;
  }
  Transform measured = perturbed(rig_.T_camera_left[c], verdict->offset.head<3>(), verdict->offset.tail<3>());
  measured.t *= length / measured.t.norm();
  watch_against(k, measured, kLearnedCovariance * verdict->covariance);
}

void RigKeeper::scene_lost() noexcept {
  any_ = false;
  log_.clear();
  for (auto& m : monitors_)
    if (m) m->reset();
  for (auto& f : feeds_)
    if (f) f->reset();
}

int RigKeeper::frames_agreed() const noexcept {
  int least = std::numeric_limits<int>::max();
  for (int k = 1; k < rig_.cameras; ++k) least = std::min(least, monitors_[static_cast<std::size_t>(k)]->frames_agreed());
  return least;
}

double RigKeeper::pixels_moved(const odometry::Map& map) const noexcept {
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

void RigKeeper::log(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome, const RigFrame& frame) noexcept {
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
  f.across = outcome.stereo_inliers;
  log_.begin(f);
  for (MapPoint& p : odometry.map().points()) {
    // A track is taken by what the left camera's pose says of it. Linked, the others' sightings are taken as they were found: the
    // calibration in use must not choose its own witnesses.
    if (!p.followed() || !p.now.by(0)) continue;
    calibration::LoggedSighting s;
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

int RigKeeper::expected_across(const odometry::Odometry& odometry, int k, const Transform& T_left_world) const noexcept {
  const Transform T = rig_.T_camera_left[static_cast<std::size_t>(k)] * T_left_world;
  const Camera& camera = odometry.front_end().lens(k).raw();
  int n = 0;
  for (const MapPoint& p : odometry.map().points()) {
    Vec2 at;
    if (p.stage == odometry::PointStage::active && p.now.by(0) && camera.project(T * p.p_world, &at, nullptr) == ProjectStatus::ok &&
        camera.inside(at, kImageMargin))
      ++n;
  }
  return n;
}

MonitorVerdict RigKeeper::watch(const odometry::Odometry& odometry, const odometry::FrameOutcome& outcome, const RigFrame& frame) noexcept {
  MonitorVerdict worst;
  const Transform step = any_ ? outcome.T_left_world * T_left_world_.inverse() : Transform{};
  T_left_world_ = outcome.T_left_world;
  any_ = true;
  for (int k = 1; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    across_.clear();
    int found = 0;
    for (const MapPoint& p : odometry.map().points()) {
      // A point made in this frame was sought in the band of the calibration in use: it is no witness.
      if (!p.followed() || p.found < 2 || !p.now.by(0)) continue;
      if (((p.in_images >> static_cast<unsigned>(k)) & 1U) == 0) continue;
      if (p.stage == odometry::PointStage::active) ++found;
      (void)across_.push({p.now.pixel[0].cast<double>(), p.now.pixel[c].cast<double>(),
                          static_cast<double>(std::max(p.now.sigma[0], p.now.sigma[c])), p.id});
    }
    calibration::MonitorFrame f = feeds_[c]->next(frame.stamp, frame.number, across_.span(), step);
    f.expected_across = outcome.images_good ? expected_across(odometry, k, outcome.T_left_world) : 0;
    f.found_across = found;
    MonitorVerdict v = monitors_[c]->look(f);
    if (grace_[c] > 0) {
      --grace_[c];
      v = MonitorVerdict{};
    }
    learn(k, &v);
    if (rank(v.kind) > rank(worst.kind) || (rank(v.kind) == rank(worst.kind) && (v.undecided || v.statistic > worst.statistic))) worst = v;
  }
  return worst;
}

void RigKeeper::seek(CalibrationCause cause, std::uint64_t onset, std::uint64_t now) noexcept {
  cause_ = cause;
  onset_ = onset;
  sought_since_ = now;
  seeking_ = true;
  frames_still_ = 0;
  rejections_ = 0;
  gate_ = Gate::open;
  stale_ = solving_;
  log_.drop_before(onset);
  logged_ = log_.size();
  wanted_ = static_cast<std::size_t>(options_.calibration.min_frames);
}

Reason RigKeeper::missing() const noexcept {
  if (!seeking_) return Reason::none;
  if (frames_still_ > kStillFrames || gate_ == Gate::needs_motion) return Reason::needs_motion;
  return gate_ == Gate::needs_near_structure ? Reason::needs_near_structure : Reason::none;
}

bool RigKeeper::can_solve() const noexcept {
  return seeking_ && !solving_ && logged_ >= wanted_ && log_.size() >= static_cast<std::size_t>(options_.calibration.min_frames);
}

void RigKeeper::start_solve() noexcept {
  rig_solver_.log().copy(log_, log_.size());
  solving_ = true;
  stale_ = false;
  frames_since_snapshot_ = 0;
  runner_.start(TaskRef(task_));
}

std::optional<CalibrationDecision> RigKeeper::decide(Stamp stamp, std::uint64_t number) noexcept {
  if (!solving_) return std::nullopt;
  ++frames_since_snapshot_;
  if (options_.adoption == Adoption::when_ready) {
    if (runner_.busy() || frames_since_snapshot_ < std::min(kLeastHeldOut, options_.calibration.adopt_after)) return std::nullopt;
  } else {
    if (frames_since_snapshot_ < options_.calibration.adopt_after) return std::nullopt;
    runner_.wait();
  }
  solving_ = false;
  if (stale_) return std::nullopt;
  return judge(stamp, number, false);
}

std::optional<CalibrationDecision> RigKeeper::decide_now(Stamp stamp, std::uint64_t number) noexcept {
  if (!solving_) return std::nullopt;
  runner_.wait();
  solving_ = false;
  if (stale_) return std::nullopt;
  return judge(stamp, number, true);
}

bool RigKeeper::start_last_solve() noexcept {
  if (solving_ || log_.size() < static_cast<std::size_t>(options_.calibration.min_frames)) return false;
  start_solve();
  return true;
}

CalibrationDecision RigKeeper::judge(Stamp stamp, std::uint64_t number, bool last) noexcept {
  calibration::GateQuestion question;
  question.solution = &solution_;
  question.nominal = &nominal_;
  question.in_use = calibrated_ ? &rig_ : nullptr;
  question.log = &log_;
  const auto most = static_cast<std::size_t>(options_.calibration.max_frames);
  question.window_full = last || static_cast<std::size_t>(solution_.frames) >= most;
  gate_ = calibration::ask_gates(question, options_.calibration);

  CalibrationDecision d;
  d.stamp = stamp;
  d.cause = cause_;
  d.accepted = gate_ == Gate::open;
  d.reason = calibration::reason(gate_);
  d.calibration = solution_.rig;
  d.latency_frames = static_cast<int>(number - sought_since_);
  d.onset_frame = onset_;
  d.held_out_after_px = calibration::held_out(log_, solution_.newest, solution_.rig).median_px;
  if (calibrated_) d.held_out_before_px = calibration::held_out(log_, solution_.newest, rig_).median_px;
  d.solve_ms = solution_.solve_ms;
  if (gate_ == Gate::sigmas_too_large || gate_ == Gate::needs_motion || gate_ == Gate::needs_near_structure) {
    // More of the same helps: sigmas fall with the root of the number of frames.
    const double excess = gate_ == Gate::sigmas_too_large ? calibration::sigma_excess(solution_.rig, options_.calibration) : 1.0;
    const double grow = std::clamp(excess * excess, kGrow, 4.0);
    wanted_ = std::max(std::min(most, static_cast<std::size_t>(std::ceil(grow * solution_.frames))), logged_ + kNewFrames);
  } else if (gate_ != Gate::open) {
    // The same frames would say the same again; and what is rejected again and again is asked about less and less often.
    log_.drop_before(solution_.newest + 1);
    wanted_ = logged_ - log_.size() + (static_cast<std::size_t>(options_.calibration.min_frames) << std::min(rejections_, kMostDoublings));
    ++rejections_;
  }
  return d;
}

}  // namespace vergence
