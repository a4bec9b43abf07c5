#include "core/calibration/detail/change_detector.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"

namespace vergence::calibration::detail {
namespace {

// What correlated tracks bring in over their life, until it is measured: times the spread of the
// first frame, of the first look; and the frames (looks) that guess weighs.
constexpr double kFirstLife = 6.5, kFirstMotion = 2.0, kGuessFrames = 30, kGuessLooks = 4;
// Of the scatter's variance, in residuals of motion: two instants have it each, and along the
// baseline, where no epipolar line measures it, real lenses leave more of it than across.
constexpr double kMotionBias = 4;
constexpr double kForgetAcross = 1.0 / 300, kForgetFast = 1.0 / 10,
                 kForgetMotion = 1.0 / 40;  // a frame, a frame, a look
constexpr double kLeastInflation = 0.3,
                 kMostInflation =
                     200;  // below: sigmas claimed far too large; above: not a spread any more
constexpr double kSpreadOutlier = 5;  // times the inflation: what one frame may count for at most,
                                      // else one frame blinds the monitor
// Windows that are also held against what was seen before them: a knock smaller than the
// reference's own error shows so, and only so.
constexpr std::size_t kLearnWindow = 10, kLearnLongest = 150;
constexpr std::size_t kScatterBlocks =
    10;  // before a block, that it is held against: longer ago a rig may have crept
// Of the blocks older than so many only every fourth is asked whether it is the onset: a search
// every frame of an alarm costs little then.
constexpr std::size_t kFineBlocks = 24, kCoarse = 4;
constexpr double kPriorSigma = 0.2;  // rad: of directions nothing was seen of
constexpr double kRelease = 0.5;  // of the threshold: an alarm stands until the statistic is below
constexpr double kRampShare = 0.05;  // a ramp's best step explains 8/9 of it
constexpr double kRampMargin = 10;   // gain by which a drift must beat a knock
constexpr int kRampFrames = 150;     // and the least length of one
constexpr double kLagMargin =
    25;                         // gain by which a lag must beat every fixed or drifting transform
constexpr double kLagMost = 2;  // frames: what pairs images farther apart is no camera's fault
constexpr double kLagModel =
    0.6;  // frames: error of a lag from few frames, where speed and rocking change within one
constexpr double kLagExplains =
    0.6;                       // share of the gain from which a lag alone is a rival of the knock
constexpr int kLagFrames = 8;  // and the least frames it must have lasted
constexpr int kLagPatience = 30;  // frames a verdict waits for the rivals to part

}  // namespace

void ChangeDetector::reset(const MonitorOptions& options, const Mat5& covariance) noexcept {
  options_ = options;
  covariance_ = covariance;
  renew_floor();
  window_count_ = 0;
  for (const int frames : {options.short_window, 10, 30, 75, 150, options.long_window}) {
    const auto n = static_cast<std::size_t>(frames);
    if (n > static_cast<std::size_t>(options.long_window) ||
        (window_count_ > 0 && n <= detector_[window_count_ - 1]))
      continue;
    detector_[window_count_++] = n;
  }
  history_.clear();
  pending_.reset();
  lambda_stereo_ = lambda_motion_ = now_fast_ = now_slow_ = life_slow_ = 0;
  residuals_ = 0;
  over_ = 0;
  newest_statistic_ = 0;
}

void ChangeDetector::expect_scatter(double bias_px) noexcept {
  scatter_.expect(std::max(bias_px, options_.bias_px));
  renew_floor();
}

void ChangeDetector::renew_floor() noexcept {
  const double least = options_.bias_px * options_.bias_px / kFixed;
  bias2_ = std::max(least, scatter_.variance());
  motion_bias2_ = std::max(least, kMotionBias * scatter_.variance());
}

/// The block just closed against those before it.
void ChangeDetector::measure_scatter() noexcept {
  // What may be a change of the rig is no scatter.
  if (history_.closed() == 0 || newest_statistic_ > kRelease * options_.threshold) return;
  Evidence past;
  for (std::size_t i = 0; i < std::min(history_.blocks(), kScatterBlocks); ++i)
    past.add(history_.block(i).evidence.stereo);
  scatter_.add(history_.open().evidence.stereo, past, lambda_stereo_);
  renew_floor();
}

void ChangeDetector::follow_spread(const FrameEvidence& e) noexcept {
  const auto follow = [](double* mean, double value, double rate) {
    const double most = kSpreadOutlier * *mean;
    if (value > -most) *mean += rate * (std::min(value, most) - *mean);  // also refuses NaN
  };
  if (history_.frames() == 0) {
    now_fast_ = now_slow_ = e.spread_now;
    life_slow_ = kFirstLife * e.spread_now;
  } else {
    const double n = static_cast<double>(history_.frames());
    follow(&now_fast_, e.spread_now, kForgetFast);
    follow(&now_slow_, e.spread_now, std::max(kForgetAcross, 1.0 / (n + 1)));
    follow(&life_slow_, e.spread_life, std::max(kForgetAcross, 1.0 / (n + kGuessFrames)));
  }
  // Noise that has just grown (rain, dusk) counts at once, for the tracks it will go on to spoil.
  const double grown = now_slow_ > 0 ? std::max(1.0, now_fast_ / now_slow_) : 1.0;
  lambda_stereo_ =
      std::clamp(std::max(life_slow_, now_slow_) * grown, kLeastInflation, kMostInflation);
  if (e.spread_motion < 0) return;
  if (residuals_ == 0)
    lambda_motion_ = kFirstMotion * e.spread_motion;
  else
    follow(&lambda_motion_, e.spread_motion,
           std::max(kForgetMotion, 1.0 / (static_cast<double>(residuals_) + kGuessLooks)));
  lambda_motion_ = std::clamp(lambda_motion_, kLeastInflation, kMostInflation);
  ++residuals_;
}

bool ChangeDetector::stands_out(const FrameEvidence& e) const noexcept {
  if (history_.frames() == 0) return false;
  Vec5 mean;
  Mat5 covariance;
  learn(TwoEvidences{}, &mean, &covariance);
  Evidence alone;
  alone.add(e.evidence.stereo, 1.0 / (lambda_stereo_ + bias2_ * e.evidence.stereo.n));
  return statistic(alone, mean, covariance) > options_.threshold;
}

void ChangeDetector::push(const FrameEvidence& e) noexcept {
  const bool out = stands_out(e);
  if (pending_ && out) {
    take(*pending_);
    pending_.reset();
  } else if (out && over_ == 0) {
    pending_ = e;
    return;
  }
  pending_.reset();
  take(e);
}

void ChangeDetector::take(const FrameEvidence& e) noexcept {
  follow_spread(e);
  if (!history_.push({e.frame, e.before, e.evidence})) return;
  measure_scatter();
  history_.close_block();
}

Evidence ChangeDetector::effective(const TwoEvidences& sum) const noexcept {
  Evidence e;
  e.add(sum.stereo, 1.0 / (lambda_stereo_ + bias2_ * sum.stereo.n));
  if (sum.motion.n > 0) e.add(sum.motion, 1.0 / (lambda_motion_ + motion_bias2_ * sum.motion.n));
  return e;
}

double ChangeDetector::statistic(const Evidence& e, const Vec5& mean,
                                 const Mat5& covariance) noexcept {
  const Mat5 A = fixed_block(e);
  const Mat5 M = A + A * covariance * A;
  std::array<double, kTriangle> packed{};
  for (int i = 0; i < kFixed; ++i)
    for (int j = 0; j <= i; ++j) packed[lower(i, j)] = M(i, j);
  Theta g = e.g;
  Eigen::Map<Vec5>(g.data()) -= A * mean;
  return Solved(packed, g).fixed_gain();
}

void ChangeDetector::learn(const TwoEvidences& window, Vec5* mean,
                           Mat5* covariance) const noexcept {
  TwoEvidences past = history_.total();
  past.add(window, -1.0);
  // Without the floor: window and past share most of the slow error, and the window's own floor
  // stands for what they do not share.
  Evidence e;
  e.add(past.stereo, 1.0 / lambda_stereo_);
  if (past.motion.n > 0) e.add(past.motion, 1.0 / lambda_motion_);
  // (C⁻¹ + A)⁻¹, written so that neither need have an inverse.
  const Mat5 spread = Mat5::Identity() + covariance_ * fixed_block(e);
  *covariance = lu_solve(spread, covariance_);
  *mean = *covariance * Eigen::Map<const Vec5>(e.g.data());
}

void ChangeDetector::estimate(const Evidence& e, Vec5* theta, Mat5* covariance) const noexcept {
  Mat5 A = fixed_block(e);
  A.diagonal().array() += 1.0 / (kPriorSigma * kPriorSigma);
  const Cholesky<5> factor(A);
  *covariance = factor.inverse();
  *theta = factor.solve(Vec5(Eigen::Map<const Vec5>(e.g.data())));
}

double ChangeDetector::single(const Evidence& stereo, double spread) const noexcept {
  Evidence e;
  e.add(stereo, 1.0 / (std::max(spread, kLeastInflation) + bias2_ * stereo.n));
  return statistic(e, Vec5::Zero(), covariance_);
}

double ChangeDetector::lag_statistic(const Evidence& stereo) const noexcept {
  Evidence e;
  e.add(stereo, 1.0 / (lambda_stereo_ + bias2_ * stereo.n));
  for (int i = 0; i < kFixed; ++i) e.g[static_cast<std::size_t>(i)] = e.A[lower(kLag, i)];
  return statistic(e, Vec5::Zero(), covariance_);
}

void ChangeDetector::single_estimate(const Evidence& stereo, double spread, Vec5* theta,
                                     Mat5* covariance) const noexcept {
  Evidence e;
  e.add(stereo, 1.0 / (std::max(spread, kLeastInflation) + bias2_ * stereo.n));
  estimate(e, theta, covariance);
}

Decision ChangeDetector::decide() noexcept {
  Decision d;
  d.lag_sigma = d.yaw_sigma = std::numeric_limits<double>::infinity();
  const std::size_t count = history_.frames();
  if (count == 0) return d;
  d.onset = history_.recent(0).frame;
  bool lagging = false;
  Evidence longest;
  std::size_t window = 0;  // of the largest statistic
  const auto stands_out = [this](const Solved& s) {
    return std::abs(s.lag()) > options_.lag_frames &&
           std::abs(s.lag()) > options_.lag_sigmas * s.lag_sigma();
  };
  TwoEvidences sum;
  std::size_t summed = 0;
  for (std::size_t w = 0; w < window_count_ && detector_[w] <= count; ++w) {
    if (detector_[w] <= EvidenceHistory::kRecent) {
      for (; summed < detector_[w]; ++summed) sum.add(history_.recent(summed).evidence);
    } else {
      history_.sum_of(detector_[w], &sum);
    }
    longest = effective(sum);
    double most = statistic(longest, Vec5::Zero(), covariance_);
    if (detector_[w] >= kLearnWindow && detector_[w] <= kLearnLongest &&
        count >= 2 * detector_[w]) {
      Vec5 learnt;
      Mat5 covariance;
      learn(sum, &learnt, &covariance);
      most = std::max(most, statistic(longest, learnt, covariance));
    }
    if (most > d.statistic) d.statistic = most, window = detector_[w];
    Evidence stereo;
    stereo.add(sum.stereo, 1.0 / (lambda_stereo_ + bias2_ * sum.stereo.n));
    const Solved solved(stereo.A, stereo.g);
    d.lag = solved.lag();
    d.lag_sigma = solved.lag_sigma();
    lagging = lagging || stands_out(solved);
  }
  newest_statistic_ = d.statistic;
  estimate(longest, &d.theta, &d.covariance);
  d.yaw_sigma = std::sqrt(d.covariance(kYaw, kYaw));
  const double limit = over_ > 0 ? kRelease * options_.threshold : options_.threshold;
  over_ = d.statistic > limit ? over_ + 1 : 0;
  if (over_ > 0 || lagging) attribute(window, &d);
  d.undecided = d.undecided || pending_.has_value();
  return d;
}

void ChangeDetector::search(const Vec5& mean, Search* found) const noexcept {
  struct Moments {
    Evidence zeroth, first, second;  // Σ e, Σ age e, Σ age² e from now back
    void add(const Evidence& e, double scale, double age) noexcept {
      zeroth.add(e, scale), first.add(e, scale * age), second.add(e, scale * age * age);
    }
    [[nodiscard]] Evidence ramp(double length) const noexcept {  // weight 1 − age/length
      Evidence r = zeroth;
      for (std::size_t i = 0; i < r.g.size(); ++i) r.g[i] -= first.g[i] / length;
      for (std::size_t i = 0; i < r.A.size(); ++i)
        r.A[i] += (second.A[i] / length - 2 * first.A[i]) / length;
      return r;
    }
  };
  Moments all, stereo;
  TwoEvidences raw;
  const auto take = [&](const Entry& entry, double age, int frames, bool ask) {
    all.add(entry.evidence.stereo, 1.0 / lambda_stereo_, age);
    stereo.add(entry.evidence.stereo, 1.0 / lambda_stereo_, age);
    if (entry.evidence.motion.n > 0) all.add(entry.evidence.motion, 1.0 / lambda_motion_, age);
    raw.add(entry.evidence);
    if (!ask) return;
    const auto solved = [&](const Evidence& e) {
      Theta g = e.g;
      for (int i = 0; i < kTheta; ++i)
        for (int j = 0; j < kFixed; ++j)
          g[static_cast<std::size_t>(i)] -= e.A[lower(std::max(i, j), std::min(i, j))] * mean[j];
      return Solved(e.A, g);
    };
    const auto keep = [&](Onset* best, double gain, const Evidence& sum) {
      if (gain > best->gain) *best = Onset{gain, entry.frame, frames, sum, raw};
    };
    const Solved fixed = solved(all.zeroth), lagged = solved(stereo.zeroth);
    keep(&found->step, fixed.fixed_gain(), all.zeroth);
    keep(&found->step_stereo, lagged.fixed_gain(), stereo.zeroth);
    keep(&found->both_stereo, lagged.fixed_gain() + lagged.lag_gain(), stereo.zeroth);
    if (frames < kRampFrames) return;
    const Evidence ramp = all.ramp(frames), ramp_stereo = stereo.ramp(frames);
    keep(&found->ramp, solved(ramp).fixed_gain(), ramp);
    keep(&found->ramp_stereo, solved(ramp_stereo).fixed_gain(), ramp_stereo);
  };
  // Single frames up to a block's edge, then blocks.
  constexpr std::size_t kBlock = EvidenceHistory::kBlock;
  const std::size_t open = history_.open_frames();
  const std::size_t whole = std::min((EvidenceHistory::kRecent - open) / kBlock, history_.closed());
  const std::size_t singles = open + whole * kBlock;
  for (std::size_t age = 0; age < singles; ++age)
    take(history_.recent(age), static_cast<double>(age), static_cast<int>(age) + 1, true);
  for (std::size_t b = whole; b < history_.blocks(); ++b) {
    const std::size_t oldest = open + (b + 1) * kBlock - 1;
    take(history_.block(b), static_cast<double>(oldest) - 0.5 * (kBlock - 1),
         static_cast<int>(oldest) + 1, b < kFineBlocks || b % kCoarse == 0);
  }
}

bool ChangeDetector::find_lag(const Search& found, Decision* d) const noexcept {
  const Onset& both = found.both_stereo;
  Evidence e;
  e.add(both.raw.stereo, 1.0 / (lambda_stereo_ + bias2_ * both.raw.stereo.n));
  const Solved lag(e.A, e.g);
  const double size = std::abs(lag.lag());
  if (both.frames < kLagFrames || !(size > options_.lag_frames && size < kLagMost &&
                                    size > options_.lag_sigmas * lag.lag_sigma()))
    return false;
  if (both.gain < std::max(found.step_stereo.gain, found.ramp_stereo.gain) + kLagMargin)
    return false;
  d->kind = MonitorVerdict::Kind::out_of_step;
  d->lag = lag.lag();
  d->lag_sigma = lag.lag_sigma();
  d->onset = both.frame;
  d->frames = both.frames;
  estimate(e, &d->theta, &d->covariance);
  return true;
}

bool ChangeDetector::lag_is_rival(const Search& found) const noexcept {
  const Onset& step = found.step_stereo;
  const double A = step.since.A[lower(kLag, kLag)], g = step.since.g[kLag];
  if (!(A > 0) || g * g / A < kLagExplains * step.gain) return false;
  const double alone = g / A;
  if (std::abs(alone) < options_.lag_frames || std::abs(alone) > kLagMost) return false;
  const Solved both(step.since.A, step.since.g);
  return std::abs(both.lag() - alone) < std::max(options_.lag_sigmas * both.lag_sigma(), kLagModel);
}

TwoEvidences ChangeDetector::since(const Onset& onset) const noexcept {
  // A look from before the onset to after it compares two rigs: it alarms, but it measures neither.
  TwoEvidences sum = onset.raw;
  const std::size_t frames = std::min<std::size_t>(
      {static_cast<std::size_t>(onset.frames), EvidenceHistory::kRecent, history_.frames()});
  for (std::size_t age = 0; age < frames; ++age) {
    const Entry& e = history_.recent(age);
    if (e.evidence.motion.n > 0 && e.before < onset.frame) sum.motion.add(e.evidence.motion, -1.0);
  }
  return sum;
}

void ChangeDetector::attribute(std::size_t window, Decision* d) noexcept {
  // What the rig was before, where that is known: a reference that is a little off is no onset.
  Vec5 mean = Vec5::Zero();
  const std::size_t recent_frames = std::clamp(window, kLearnWindow, kLearnLongest);
  if (history_.frames() >= 2 * recent_frames) {
    TwoEvidences sum;
    Mat5 covariance;
    history_.sum_of(recent_frames, &sum);
    learn(sum, &mean, &covariance);
  }
  Search found;
  search(mean, &found);
  if (find_lag(found, d)) return;
  if (over_ == 0) return;  // the lag of a window alone, which a step inside that window can make
  if (over_ <= kLagPatience && lag_is_rival(found)) {
    d->undecided = true;
    return;
  }
  const bool ramp =
      found.ramp.gain > found.step.gain + std::max(kRampMargin, kRampShare * found.step.gain);
  d->kind = ramp ? MonitorVerdict::Kind::drift : MonitorVerdict::Kind::knock;
  const Onset& onset = ramp ? found.ramp : found.step;
  d->onset = onset.frame;
  d->frames = onset.frames;
  estimate(ramp ? onset.since : effective(since(onset)), &d->theta, &d->covariance);
}

}  // namespace vergence::calibration::detail
