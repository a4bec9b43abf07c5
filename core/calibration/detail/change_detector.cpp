#include "core/calibration/detail/change_detector.hpp"

#include <algorithm>

#include "core/math/linear_solve.hpp"

namespace vergence::calibration::detail {
namespace {

// Initial inflation by errors correlated along tracks, as a multiple of the first frame's spread,
// and the number of frames by which it is weighted.
constexpr double kFirstLife = 6.5, kGuessFrames = 30;
// Minimum of the inflation; below, stated sigmas are far too large.
constexpr double kMinInflation = 0.3;
// Limit of one frame's spread in units of the running mean; without it a single frame could
// desensitise the monitor.
constexpr double kSpreadOutlier = 5;
// Share of the threshold below which an alarm ends.
constexpr double kRelease = 0.5;
// Ratio of gains by which a drift must exceed a knock. The best step explains 8/9 of a ramp; this
// ratio is the geometric mean of 9/8 and 1.
constexpr double kRampGain = 1.06;
// Ratio to the expected scatter above which a block's offset is a change of the rig.
constexpr double kMaxOfExpected = 20;
// Length of the running mean, in blocks: half a minute at 30 Hz.
constexpr std::uint64_t kMaxBlocks = 60;

}  // namespace

bool EvidenceHistory::push(const Entry& entry) noexcept {
  recent_[count_ % kRecent] = entry;
  if (count_ % kBlock == 0) open_ = Entry{entry.frame, {}};
  open_.evidence.add(entry.evidence);
  if (++count_ % kBlock != 0) return false;
  if (closed_ >= kBlocks) total_.add(blocks_[closed_ % kBlocks].evidence, -1.0);
  total_.add(open_.evidence);
  blocks_[closed_ % kBlocks] = open_;
  ++closed_;
  open_ = Entry{};
  return true;
}

Evidence EvidenceHistory::sum_newest(std::size_t frames) const noexcept {
  Evidence sum = open_.evidence;
  const std::size_t open = open_frames();
  const std::size_t count =
      std::min((frames - std::min(frames, open) + kBlock - 1) / kBlock, blocks());
  for (std::size_t i = 0; i < count; ++i) sum.add(block(i).evidence);
  return sum;
}

Evidence EvidenceHistory::total() const noexcept {
  Evidence sum = total_;
  sum.add(open_.evidence);
  return sum;
}

void BlockScatter::add(const Evidence& block, const Evidence& past, double lambda) noexcept {
  if (!(block.n > 0) || !(past.n > 0)) return;
  const Cholesky<5> of_block(block.A), of_past(past.A);
  if (!of_block.ok() || !of_past.ok()) return;
  const Vec5 d = of_block.solve(block.g) - of_past.solve(past.g);
  const double by_noise = lambda * (kTheta + (block.A * of_past.inverse()).trace());
  const double scatter = (d.dot(block.A * d) - by_noise) / (kTheta * block.n);
  const double limit = kMaxOfExpected * std::max(variance(), lambda / block.n);
  // The comparison also rejects NaN.
  if (!(scatter < limit)) return;
  if (blocks_ == kMaxBlocks) {
    sum_ -= sum_ / static_cast<double>(blocks_);
    --blocks_;
  }
  sum_ += scatter;
  ++blocks_;
}

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
  lambda_ = now_fast_ = now_slow_ = life_slow_ = 0;
  over_ = 0;
  newest_statistic_ = 0;
}

void ChangeDetector::expect_scatter(double bias_px) noexcept {
  scatter_.expect(std::max(bias_px, options_.bias_px));
  renew_floor();
}

void ChangeDetector::renew_floor() noexcept {
  bias2_ = std::max(options_.bias_px * options_.bias_px / kTheta, scatter_.variance());
}

/// Measures the scatter of the completed block against those before it.
void ChangeDetector::measure_scatter() noexcept {
  // A possible change of the rig must not be counted as scatter.
  if (history_.closed() == 1 || newest_statistic_ > kRelease * options_.threshold) return;
  Evidence past;
  // The rig may have drifted since older blocks.
  const std::size_t recent =
      static_cast<std::size_t>(options_.long_window) / EvidenceHistory::kBlock;
  for (std::size_t i = 1; i <= std::min(history_.closed() - 1, recent); ++i)
    past.add(history_.block(i).evidence);
  scatter_.add(history_.block(0).evidence, past, lambda_);
  renew_floor();
}

void ChangeDetector::follow_spread(const StereoResiduals& e) noexcept {
  const auto follow = [](double* mean, double value, double rate) {
    const double limit = kSpreadOutlier * *mean;
    // The comparison also rejects NaN.
    if (value > -limit) *mean += rate * (std::min(value, limit) - *mean);
  };
  if (history_.frames() == 0) {
    now_fast_ = now_slow_ = e.spread_now;
    life_slow_ = kFirstLife * e.spread_now;
  } else {
    const double n = static_cast<double>(history_.frames());
    follow(&now_fast_, e.spread_now, kFastUpdate);
    const double slow = 1.0 / options_.long_window;
    follow(&now_slow_, e.spread_now, std::max(slow, 1.0 / (n + 1)));
    follow(&life_slow_, e.spread_life, std::max(slow, 1.0 / (n + kGuessFrames)));
  }
  // Noise that has just grown (rain, dusk) counts immediately, because it will affect the tracks to
  // come.
  const double grown = now_slow_ > 0 ? std::max(1.0, now_fast_ / now_slow_) : 1.0;
  lambda_ = std::max(std::max(life_slow_, now_slow_) * grown, kMinInflation);
}

bool ChangeDetector::stands_out(const StereoResiduals& e) const noexcept {
  if (history_.frames() == 0)
    return single(e.evidence, kFirstLife * e.spread_now) > options_.threshold;
  return statistic(effective(e.evidence), estimate_reference({})) > options_.threshold;
}

void ChangeDetector::push(const StereoResiduals& e) noexcept {
  const bool out = stands_out(e);
  if (pending_ && out) {
    add(*pending_);
  } else if (out && over_ == 0) {
    pending_ = e;
    return;
  }
  pending_.reset();
  add(e);
}

void ChangeDetector::add(const StereoResiduals& e) noexcept {
  follow_spread(e);
  if (history_.push({e.frame, e.evidence})) measure_scatter();
}

Evidence ChangeDetector::effective(const Evidence& sum) const noexcept {
  return sum.scaled(1.0 / (lambda_ + bias2_ * sum.n));
}

double ChangeDetector::statistic(const Evidence& e, const Theta& reference) noexcept {
  return gain(e.A + e.A * reference.covariance * e.A, e.g - e.A * reference.mean);
}

ChangeDetector::Theta ChangeDetector::estimate_reference(const Evidence& window) const noexcept {
  Evidence past = history_.total();
  past.add(window, -1.0);
  // Without the floor: the window and the past share most of the slow error, and the window's own
  // floor covers the rest.
  const Evidence e = past.scaled(1.0 / lambda_);
  // This is (C⁻¹ + A)⁻¹ in a form that needs neither inverse.
  const Mat5 spread = Mat5::Identity() + covariance_ * e.A;
  const Mat5 covariance = lu_solve(spread, covariance_);
  return {covariance * e.g, covariance};
}

double ChangeDetector::single(const Evidence& frame, double spread) const noexcept {
  return statistic(frame.scaled(1.0 / (std::max(spread, kMinInflation) + bias2_ * frame.n)),
                   {Vec5::Zero(), covariance_});
}

MonitorResult ChangeDetector::decide() noexcept {
  MonitorResult d;
  const std::size_t count = history_.frames();
  if (count == 0) return d;
  d.onset_frame = history_.recent(0).frame;
  // Length of the window with the largest statistic.
  std::size_t window = 0;
  Evidence sum;
  std::size_t summed = 0;
  for (std::size_t w = 0; w < window_count_ && detector_[w] <= count; ++w) {
    if (detector_[w] <= EvidenceHistory::kRecent) {
      for (; summed < detector_[w]; ++summed) sum.add(history_.recent(summed).evidence);
    } else {
      sum = history_.sum_newest(detector_[w]);
    }
    const Evidence inflated = effective(sum);
    double largest = statistic(inflated, {Vec5::Zero(), covariance_});
    // Only this comparison shows a change smaller than the reference's own error.
    if (count >= 2 * detector_[w])
      largest = std::max(largest, statistic(inflated, estimate_reference(sum)));
    if (largest > d.statistic) d.statistic = largest, window = detector_[w];
  }
  newest_statistic_ = d.statistic;
  const double limit = over_ > 0 ? kRelease * options_.threshold : options_.threshold;
  over_ = d.statistic > limit ? over_ + 1 : 0;
  if (over_ > 0) attribute(window, &d);
  d.undecided = pending_.has_value();
  return d;
}

ChangeDetector::Search ChangeDetector::search(const Vec5& mean) const noexcept {
  Search found;
  // Sums Σ e, Σ age e and Σ age² e from the newest entry back, from which a ramp's sums follow.
  Evidence zeroth, first, second;
  const auto visit = [&](const Entry& entry, double age, int frames) {
    zeroth.add(entry.evidence);
    first.add(entry.evidence, age);
    second.add(entry.evidence, age * age);
    const auto keep = [&](Onset* best, const Evidence& sum) {
      if (const double g = gain(sum.A, sum.g - sum.A * mean) / lambda_; g > best->gain)
        *best = Onset{g, entry.frame, sum};
    };
    keep(&found.step, zeroth);
    if (2 * frames < options_.long_window) return;
    // The weight of an entry is 1 − age/frames.
    Evidence ramp = zeroth;
    ramp.g -= first.g / frames;
    ramp.A += (second.A / frames - 2 * first.A) / frames;
    keep(&found.ramp, ramp);
  };
  // Single frames back to the edge of a block, then blocks.
  constexpr std::size_t block = EvidenceHistory::kBlock;
  const std::size_t open = history_.open_frames();
  const std::size_t whole = std::min((EvidenceHistory::kRecent - open) / block, history_.closed());
  const std::size_t singles = open + whole * block;
  for (std::size_t age = 0; age < singles; ++age)
    visit(history_.recent(age), static_cast<double>(age), static_cast<int>(age) + 1);
  for (std::size_t b = whole; b < history_.blocks(); ++b) {
    const std::size_t oldest = open + (b + 1) * block - 1;
    visit(history_.block(b), static_cast<double>(oldest) - 0.5 * (block - 1),
          static_cast<int>(oldest) + 1);
  }
  return found;
}

void ChangeDetector::attribute(std::size_t window, MonitorResult* d) const noexcept {
  // Subtract the offset before the window if it is known: a slightly wrong reference is not an
  // onset.
  Vec5 mean = Vec5::Zero();
  if (history_.frames() >= 2 * window) mean = estimate_reference(history_.sum_newest(window)).mean;
  const Search found = search(mean);
  const bool ramp = found.ramp.gain > kRampGain * found.step.gain;
  d->kind = ramp ? MonitorResult::Kind::drift : MonitorResult::Kind::knock;
  const Onset& onset = ramp ? found.ramp : found.step;
  d->onset_frame = onset.frame;
  d->evidence = {0.5 * d->statistic, shift_px(onset.since), 0};
}

}  // namespace vergence::calibration::detail
