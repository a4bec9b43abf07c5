#include "core/calibration/detail/monitor_windows.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace vergence::calibration::detail {
namespace {

// Inflation before anything is measured, and how many frames (looks) it weighs: what correlated tracks of method and mock show.
constexpr double kFirstAcross = 6.0, kFirstMotion = 1.5;
constexpr double kForgetAcross = 1.0 / 300, kForgetMotion = 1.0 / 40;  // a frame, a look
constexpr double kLeastInflation = 0.3, kMostInflation = 200;          // below: sigmas claimed far too large; above: not a spread any more
constexpr double kSpreadOutlier = 5;  // times the inflation: what one frame may count for at most, else one frame blinds the monitor
constexpr double kPriorSigma = 0.2;   // rad: of directions nothing was seen of
constexpr double kRampMargin = 10;    // gain by which a drift must beat a knock
constexpr int kRampFrames = 90;       // and the least length of one
constexpr double kLagMargin = 25;     // gain by which a lag must beat every fixed or drifting transform
constexpr double kLagExplains = 0.8;  // share of the gain from which a lag alone is a rival of the knock
constexpr int kLagPatience = 30;      // frames a verdict waits for the rivals to part

}  // namespace

void Windows::reset(const MonitorOptions& options, const Mat5& covariance) noexcept {
  options_ = options;
  covariance_ = covariance;
  bias2_ = options.bias_px * options.bias_px;
  window_count_ = 0;
  for (const int frames : {options.short_window, 10, 30, 90, options.long_window}) {
    const auto n = static_cast<std::size_t>(frames);
    if (n > static_cast<std::size_t>(options.long_window) || (window_count_ > 0 && n <= windows_[window_count_ - 1])) continue;
    windows_[window_count_++] = n;
  }
  count_ = closed_ = 0;
  open_ = Entry{};
  lambda_across_ = kFirstAcross;
  lambda_motion_ = kFirstMotion;
  over_ = 0;
}

void Windows::push(const FrameEvidence& e) noexcept {
  const auto follow = [](double* lambda, double spread, double rate) {
    if (!(spread >= -kSpreadOutlier * *lambda)) return;  // also refuses NaN
    const double bounded = std::min(spread, kSpreadOutlier * *lambda);
    *lambda = std::clamp(*lambda + rate * (bounded - *lambda), kLeastInflation, kMostInflation);
  };
  follow(&lambda_across_, e.spread_life, kForgetAcross);
  if (e.spread_motion >= 0) follow(&lambda_motion_, e.spread_motion, kForgetMotion);
  Entry& entry = recent_[count_ % kRecent];
  entry.frame = e.frame;
  entry.evidence = e.evidence;
  if (count_ % kBlock == 0) open_ = Entry{e.frame, {}};
  open_.evidence.add(e.evidence);
  ++count_;
  if (count_ % kBlock == 0) {
    blocks_[closed_ % kBlocks] = open_;
    ++closed_;
    open_ = Entry{};
  }
}

Evidence Windows::effective(const TwoEvidences& sum) const noexcept {
  Evidence e;
  e.add(sum.across, 1.0 / (lambda_across_ + bias2_ * sum.across.n));
  e.add(sum.motion, 1.0 / (lambda_motion_ + bias2_ * sum.motion.n));
  return e;
}

double Windows::statistic(const Evidence& e) const noexcept {
  Mat5 A;
  for (int i = 0; i < kFixed; ++i)
    for (int j = 0; j <= i; ++j) A(i, j) = A(j, i) = e.A[lower(i, j)];
  const Mat5 M = A + A * covariance_ * A;
  std::array<double, kTriangle> packed{};
  for (int i = 0; i < kFixed; ++i)
    for (int j = 0; j <= i; ++j) packed[lower(i, j)] = M(i, j);
  return Solved(packed, e.g).fixed_gain();
}

void Windows::estimate(const Evidence& e, Vec5* theta, Mat5* covariance) const noexcept {
  Mat5 A;
  for (int i = 0; i < kFixed; ++i)
    for (int j = 0; j <= i; ++j) A(i, j) = A(j, i) = e.A[lower(i, j)];
  A.diagonal().array() += 1.0 / (kPriorSigma * kPriorSigma);
  const Eigen::LLT<Mat5> llt(A);
  *covariance = llt.solve(Mat5::Identity());
  *theta = llt.solve(Eigen::Map<const Vec5>(e.g.data()));
}

double Windows::single(const Evidence& across, double spread) const noexcept {
  Evidence e;
  e.add(across, 1.0 / (std::max(spread, kLeastInflation) + bias2_ * across.n));
  return statistic(e);
}

void Windows::single_estimate(const Evidence& across, double spread, Vec5* theta, Mat5* covariance) const noexcept {
  Evidence e;
  e.add(across, 1.0 / (std::max(spread, kLeastInflation) + bias2_ * across.n));
  estimate(e, theta, covariance);
}

void Windows::sum_of(std::size_t frames, TwoEvidences* sum) const noexcept {
  *sum = open_.evidence;
  const std::size_t open = count_ % kBlock;
  const std::size_t blocks = std::min<std::size_t>({(frames - std::min(frames, open) + kBlock - 1) / kBlock, closed_, kBlocks});
  for (std::size_t i = 0; i < blocks; ++i) sum->add(block(i).evidence);
}

Decision Windows::decide() noexcept {
  Decision d;
  d.lag_sigma = d.yaw_sigma = std::numeric_limits<double>::infinity();
  if (count_ == 0) return d;
  d.onset = recent(0).frame;
  bool lagging = false;
  TwoEvidences sum;
  std::size_t summed = 0;
  for (std::size_t w = 0; w < window_count_ && windows_[w] <= count_; ++w) {
    if (windows_[w] <= kRecent) {
      for (; summed < windows_[w]; ++summed) sum.add(recent(summed).evidence);
    } else {
      sum_of(windows_[w], &sum);
    }
    const Evidence e = effective(sum);
    const double s = statistic(e);
    Mat5 covariance;
    if (s > d.statistic || w == 0) d.statistic = s, estimate(e, &d.theta, &covariance), d.covariance = covariance;
    const Solved solved(e.A, e.g);
    d.lag = solved.lag();
    d.lag_sigma = solved.lag_sigma();
    lagging = lagging || (std::abs(d.lag) > options_.lag_frames && std::abs(d.lag) > options_.lag_sigmas * d.lag_sigma);
    Vec5 theta;
    estimate(e, &theta, &covariance);
    d.yaw_sigma = std::sqrt(covariance(kYaw, kYaw));
  }
  over_ = d.statistic > options_.threshold ? over_ + 1 : 0;
  if (over_ > 0 || lagging) attribute(&d);
  return d;
}

void Windows::search(Search* found) const noexcept {
  Evidence zeroth, first, second;  // Σ e, Σ age e, Σ age² e from now back
  TwoEvidences raw;
  const auto take = [&](const Entry& entry, double age, int frames) {
    Evidence e;
    e.add(entry.evidence.across, 1.0 / lambda_across_);
    e.add(entry.evidence.motion, 1.0 / lambda_motion_);
    zeroth.add(e);
    first.add(e, age);
    second.add(e, age * age);
    raw.add(entry.evidence);
    const auto keep = [&](Onset* best, double gain, const Evidence& since) {
      if (gain > best->gain) *best = Onset{gain, entry.frame, frames, since, raw};
    };
    const Solved solved(zeroth.A, zeroth.g);
    keep(&found->step, solved.fixed_gain(), zeroth);
    keep(&found->both, solved.fixed_gain() + solved.lag_gain(), zeroth);
    if (frames < kRampFrames) return;
    Evidence ramp = zeroth;  // weight 1 − age/length
    const double length = frames;
    for (std::size_t i = 0; i < ramp.g.size(); ++i) ramp.g[i] -= first.g[i] / length;
    for (std::size_t i = 0; i < ramp.A.size(); ++i) ramp.A[i] += (second.A[i] / length - 2 * first.A[i]) / length;
    keep(&found->ramp, Solved(ramp.A, ramp.g).fixed_gain(), ramp);
  };
  // Single frames up to a block's edge, then blocks.
  const std::size_t open = count_ % kBlock;
  const std::size_t whole = std::min<std::size_t>((kRecent - open) / kBlock, closed_);
  const std::size_t singles = open + whole * kBlock;
  for (std::size_t age = 0; age < singles; ++age) take(recent(age), static_cast<double>(age), static_cast<int>(age) + 1);
  for (std::size_t b = whole; b < std::min<std::size_t>(closed_, kBlocks); ++b) {
    const std::size_t oldest = open + (b + 1) * kBlock - 1;
    take(block(b), static_cast<double>(oldest) - 0.5 * (kBlock - 1), static_cast<int>(oldest) + 1);
  }
}

void Windows::attribute(Decision* d) noexcept {
  using Kind = MonitorVerdict::Kind;
  Search found;
  search(&found);
  const double fixed = std::max(found.step.gain, found.ramp.gain);

  const Evidence with_lag = effective(found.both.raw);
  const Solved lag(with_lag.A, with_lag.g);
  if (std::abs(lag.lag()) > options_.lag_frames && std::abs(lag.lag()) > options_.lag_sigmas * lag.lag_sigma() &&
      found.both.gain > fixed + kLagMargin) {
    d->kind = Kind::out_of_step;
    d->lag = lag.lag();
    d->lag_sigma = lag.lag_sigma();
    d->onset = found.both.frame;
    d->frames = found.both.frames;
    return;
  }
  if (over_ == 0) return;  // the lag of a window alone, which a step inside that window can make
  const Evidence& e = found.step.since;
  const double A = e.A[lower(kLag, kLag)], alone = A > 0 ? e.g[kLag] / A : 0.0, sigma = Solved(e.A, e.g).lag_sigma();
  const bool rival = std::abs(alone) > options_.lag_frames && alone * e.g[kLag] > kLagExplains * found.step.gain &&
                     std::abs(Solved(e.A, e.g).lag() - alone) < options_.lag_sigmas * sigma;
  if (rival && over_ <= kLagPatience) {
    d->undecided = true;
    return;
  }
  const bool ramp = found.ramp.gain > found.step.gain + kRampMargin;
  d->kind = ramp ? Kind::drift : Kind::knock;
  const Onset& onset = ramp ? found.ramp : found.step;
  d->onset = onset.frame;
  d->frames = onset.frames;
  estimate(ramp ? onset.since : effective(onset.raw), &d->theta, &d->covariance);
}

}  // namespace vergence::calibration::detail
