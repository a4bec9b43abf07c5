#include "core/comparison/mount.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/comparison/detail/pose_interpolation.hpp"
#include "core/math/linear_solve.hpp"
#include "core/math/so3.hpp"

namespace vergence {
namespace {

// Parameters: R_m and R_enu_world as left perturbations, lever arm, translation, clock offset.
constexpr int kParameters = 13;
enum Index : int {
  mount_rotation = 0,
  lever = 3,
  clock = 6,
  world_rotation = 7,
  world_translation = 10
};
// Errors of a moment: tilt x y, heading, position x y, height, velocity x y z.
constexpr int kErrors = 9;
constexpr std::array<int, kErrors> kChannel{0, 0, 1, 2, 2, 3, 4, 4, 4};
constexpr int kChannels = 5;

using Parameters = Eigen::Matrix<double, kParameters, 1>;
using Information = Eigen::Matrix<double, kParameters, kParameters>;
using Errors = Eigen::Matrix<double, kErrors, 1>;

/// A reference sample at its own stamp. Interpolating it would reduce its noise depending on the
/// stamp and bias the clock offset to the middle, so the estimate, which has hardly any noise, is
/// interpolated instead.
struct Moment {
  MountReference reference{};
  // True if it is one step after the previous moment.
  bool follows = false;
};

struct State {
  Mat3 R_m = Mat3::Identity(), R_enu_world = Mat3::Identity();
  Vec3 lever = Vec3::Zero(), translation = Vec3::Zero();
  // Clock offset, in s.
  double offset = 0;
};

State moved(const State& s, const Parameters& d) {
  State out = s;
  out.R_m = exp_so3(d.segment<3>(mount_rotation)) * s.R_m;
  out.lever += d.segment<3>(lever);
  out.offset += d[clock];
  out.R_enu_world = exp_so3(d.segment<3>(world_rotation)) * s.R_enu_world;
  out.translation += d.segment<3>(world_translation);
  return out;
}

/// Median interval between samples.
Duration median_interval(std::span<const MountReference> reference) {
  // In ns.
  std::vector<std::int64_t> intervals;
  intervals.reserve(reference.size());
  for (std::size_t i = 1; i < reference.size(); ++i)
    intervals.push_back((reference[i].stamp - reference[i - 1].stamp).ns());
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return Duration::nanoseconds(std::max<std::int64_t>(1, *middle));
}

/// Spacing of moments: the whole number of samples nearest to the step, at least one.
Duration moment_spacing(Duration interval, Duration step) {
  return interval * std::max<std::int64_t>(1, (step + interval / 2).ns() / interval.ns());
}

/// Samples at the step of `o`, a multiple of the interval, with an estimate around each.
std::vector<Moment> select_moments(std::span<const StampedPose> estimate,
                                   std::span<const MountReference> reference, Duration interval,
                                   const MountOptions& o) {
  // Range for the clock offset.
  constexpr Duration kRoom = Duration::milliseconds(500);
  std::vector<Moment> moments;
  Transform unused;
  Stamp next = reference.front().stamp;
  for (const MountReference& r : reference) {
    // Allow for jitter of the stamps.
    if (r.stamp < next - interval / 2) continue;
    if (!detail::pose_at(estimate, r.stamp - kRoom, o.max_gap, &unused) ||
        !detail::pose_at(estimate, r.stamp, o.max_gap, &unused) ||
        !detail::pose_at(estimate, r.stamp + kRoom, o.max_gap, &unused))
      continue;
    moments.push_back(
        {r, !moments.empty() && r.stamp - moments.back().reference.stamp < o.step * 3 / 2});
    next = r.stamp + o.step;
  }
  return moments;
}

// Duration over which errors are similar.
constexpr Duration kBlock = Duration::milliseconds(3'000);
// Minimum number of blocks that determine their scatter.
constexpr std::size_t kBlocks = 8;

/// Information and score of the parameters from one block.
struct Block {
  Information information = Information::Zero();
  Parameters score = Parameters::Zero();
};

/// Covariance of the sum of the blocks' scores from their scatter; zero if there are too few. A
/// parameter seen by one block only is fitted to it, so its score is that of a fit to the others
/// (jackknife: Bell and McCaffrey 2002).
Information score_scatter(std::span<const Block> blocks, const Information& whole) {
  Information sum = Information::Zero();
  if (blocks.size() < kBlocks) return sum;
  const Information covariance = ldlt_inverse(whole);
  for (const Block& b : blocks) {
    const Information rest = Information::Identity() - b.information * covariance;
    const Parameters g = lu_solve(rest, b.score);
    sum += g * g.transpose();
  }
  const auto n = static_cast<double>(blocks.size());
  return (n - 1) / n * sum;
}

class Fit {
 public:
  Fit(std::vector<Moment> moments, std::span<const StampedPose> estimate,
      const MountOptions& options)
      : moments_(std::move(moments)), estimate_(estimate), options_(options) {}

  [[nodiscard]] MountStatus run(const Mat3& nominal, Mount* mount);

 private:
  /// Gauss–Markov process per channel: e_k = memory · e_{k−1} + white, with `white` a standard
  /// deviation.
  struct Noise {
    double memory = 0.98, white = 1;
  };

  [[nodiscard]] bool start(const Mat3& nominal);
  [[nodiscard]] bool errors_at(const State& s, const Moment& m, Errors* e) const;
  [[nodiscard]] bool all_errors(const State& s, std::vector<Errors>* all) const;
  [[nodiscard]] bool step(Parameters* d);
  void estimate_noise(const std::vector<Errors>& all);
  [[nodiscard]] bool settle();
  void report(const Mat3& nominal, Mount* mount) const;

  std::vector<Moment> moments_;
  std::span<const StampedPose> estimate_;
  MountOptions options_;
  State state_;
  std::array<Noise, kChannels> noise_{};
  // True if every moment has a velocity.
  bool velocity_ = true;
  Information information_ = Information::Zero();
  // Scatter of the blocks' scores.
  Information scatter_ = Information::Zero();
};

bool Fit::errors_at(const State& s, const Moment& m, Errors* e) const {
  // Half interval of the differences for velocity and rate.
  constexpr Duration kAround = Duration::milliseconds(50);
  const Stamp at = m.reference.stamp - Duration::seconds(s.offset);
  Transform here, before, after;
  if (!detail::pose_at(estimate_, at, options_.max_gap, &here)) return false;
  const MountReference& r = m.reference;
  const Mat3& R = r.T_enu_ref.R;
  // Use the reference's axes, in which a tilt is constant when the vehicle turns.
  e->segment<3>(0) = R.transpose() * log_so3(R * s.R_m * (s.R_enu_world * here.R).transpose());
  e->segment<3>(3) = r.T_enu_ref.t + R * s.lever - s.R_enu_world * here.t - s.translation;
  e->segment<3>(6).setZero();
  if (velocity_) {
    if (!detail::pose_at(estimate_, at - kAround, options_.max_gap, &before) ||
        !detail::pose_at(estimate_, at + kAround, options_.max_gap, &after))
      return false;
    const double span = 2 * kAround.to_seconds();
    const Vec3 velocity = (after.t - before.t) / span,
               rate = log_so3(before.R.transpose() * after.R) / span;
    e->segment<3>(6) = r.v_enu_ref + R * (s.R_m * rate).cross(s.lever) - s.R_enu_world * velocity;
  }
  return e->allFinite();
}

bool Fit::all_errors(const State& s, std::vector<Errors>* all) const {
  all->resize(moments_.size());
  for (std::size_t i = 0; i < moments_.size(); ++i)
    if (!errors_at(s, moments_[i], &(*all)[i])) return false;
  return true;
}

/// Solves Wahba's problem over rotations and translations, and initialises the rest from it.
/// Returns false without motion.
bool Fit::start(const Mat3& nominal) {
  Mat3 B = Mat3::Zero();
  Transform e0, e1;
  double way = 0;
  for (std::size_t i = 1; i < moments_.size(); ++i) {
    const MountReference &r0 = moments_[i - 1].reference, &r1 = moments_[i].reference;
    velocity_ = velocity_ && r0.has_velocity && r1.has_velocity;
    if (!moments_[i].follows) continue;
    if (!detail::pose_at(estimate_, r0.stamp, options_.max_gap, &e0) ||
        !detail::pose_at(estimate_, r1.stamp, options_.max_gap, &e1))
      return false;
    const Mat3 R_ref_enu = r0.T_enu_ref.R.transpose();
    const Vec3 turn_ref = log_so3(R_ref_enu * r1.T_enu_ref.R),
               turn_est = log_so3(e0.R.transpose() * e1.R);
    const Vec3 way_est = e0.R.transpose() * (e1.t - e0.t),
               way_ref = R_ref_enu * (r1.T_enu_ref.t - r0.T_enu_ref.t);
    // One radian has the weight of 20 m.
    B += 20 * turn_ref * turn_est.transpose() + way_ref * way_est.transpose();
    way += way_est.norm();
  }
  // Minimum path length in m; chosen.
  constexpr double kMinWay = 10;
  if (way < kMinWay) return false;
  const auto nearest_rotation = [](const Mat3& M) {
    const Svd3 s = svd(M);
    const Vec3 d(1, 1, (s.U * s.V.transpose()).determinant());
    return Mat3(s.U * d.asDiagonal() * s.V.transpose());
  };
  // The design rotation has a thousandth of the weight, so it only decides what is otherwise
  // undetermined.
  state_.R_m = nearest_rotation(B + 1e-3 * B.norm() * nominal);
  Mat3 sum = Mat3::Zero();
  for (const Moment& m : moments_) {
    if (!detail::pose_at(estimate_, m.reference.stamp, options_.max_gap, &e0)) return false;
    sum += m.reference.T_enu_ref.R * state_.R_m * e0.R.transpose();
  }
  state_.R_enu_world = nearest_rotation(sum);
  for (const Moment& m : moments_) {
    (void)detail::pose_at(estimate_, m.reference.stamp, options_.max_gap, &e0);
    state_.translation += (m.reference.T_enu_ref.t - state_.R_enu_world * e0.t) /
                          static_cast<double>(moments_.size());
  }
  return true;
}

void Fit::estimate_noise(const std::vector<Errors>& all) {
  for (int c = 0; c < kChannels; ++c) {
    double now = 0, lagged = 0, n = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
      if (!moments_[i].follows) continue;
      for (int k = 0; k < kErrors; ++k) {
        if (kChannel[static_cast<std::size_t>(k)] != c) continue;
        now += all[i - 1][k] * all[i - 1][k];
        lagged += all[i][k] * all[i - 1][k];
        n += 1;
      }
    }
    // Almost a random walk; above it the mean is lost to rounding.
    constexpr double kMax = 0.998;
    double memory = now > 0 ? lagged / now : 0;
    // Correct the bias of a short series' correlation (Kendall 1954) and of fitted parameters.
    memory = std::clamp(memory + (1 + 3 * memory) / std::max(8.0, static_cast<double>(all.size())),
                        0.0, kMax);
    constexpr int kVelocity = 4;
    if (c != kVelocity)
      memory = std::max(
          memory, std::exp(-options_.step.to_seconds() / options_.min_correlation.to_seconds()));
    double white = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
      if (!moments_[i].follows) continue;
      for (int k = 0; k < kErrors; ++k)
        if (kChannel[static_cast<std::size_t>(k)] == c)
          white += std::pow(all[i][k] - memory * all[i - 1][k], 2) / n;
    }
    constexpr std::array<double, kChannels> kMin{
        // Minimum noise in rad, m and m/s, also of an ideal reference.
        1e-5, 1e-5, 1e-4, 1e-4, 1e-4};
    noise_[static_cast<std::size_t>(c)] = {
        memory, std::max(std::sqrt(white), kMin[static_cast<std::size_t>(c)])};
  }
}

/// One Gauss–Newton step on the whitened errors. Returns false if the reference does not cover the
/// stamps.
bool Fit::step(Parameters* d) {
  std::vector<Errors> at;
  if (!all_errors(state_, &at)) return false;
  estimate_noise(at);
  constexpr std::array<double, kParameters> kDelta{1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-4,
                                                   1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3};
  std::vector<std::vector<Errors>> columns(kParameters);
  for (int p = 0; p < kParameters; ++p) {
    Parameters small = Parameters::Zero();
    const double h = kDelta[static_cast<std::size_t>(p)];
    small[p] = h;
    std::vector<Errors> minus;
    if (!all_errors(moved(state_, small), &columns[static_cast<std::size_t>(p)]) ||
        !all_errors(moved(state_, -small), &minus))
      return false;
    for (std::size_t i = 0; i < minus.size(); ++i)
      columns[static_cast<std::size_t>(p)][i] =
          (columns[static_cast<std::size_t>(p)][i] - minus[i]) / (2 * h);
  }
  // Weak priors keep unobserved parameters at their values.
  constexpr std::array<double, kParameters> kPrior{1, 1, 1, 100, 100, 100, 0.3,
                                                   4, 4, 4, 1e6, 1e6, 1e6};
  Information H = Information::Zero();
  Parameters g = Parameters::Zero();
  for (int p = 0; p < kParameters; ++p) H(p, p) = std::pow(kPrior[static_cast<std::size_t>(p)], -2);
  for (int p : {3, 4, 5}) g[p] = H(p, p) * state_.lever[p - lever];
  g[clock] = H(clock, clock) * state_.offset;
  const int used = velocity_ ? kErrors : 6;
  std::vector<Block> blocks;
  Stamp block_end = moments_.front().reference.stamp;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (moments_[i].reference.stamp >= block_end) {
      blocks.emplace_back();
      block_end = moments_[i].reference.stamp + kBlock;
    }
    for (int k = 0; k < used; ++k) {
      const Noise& noise = noise_[static_cast<std::size_t>(kChannel[static_cast<std::size_t>(k)])];
      const bool chained = moments_[i].follows;
      const double memory = chained ? noise.memory : 0;
      const double weight =
          1 / (chained ? noise.white : noise.white / std::sqrt(1 - noise.memory * noise.memory));
      Parameters row;
      for (int p = 0; p < kParameters; ++p) {
        const auto& column = columns[static_cast<std::size_t>(p)];
        row[p] = weight * (column[i][k] - (chained ? memory * column[i - 1][k] : 0));
      }
      const double value = weight * (at[i][k] - (chained ? memory * at[i - 1][k] : 0));
      H += row * row.transpose();
      g += row * value;
      blocks.back().information += row * row.transpose();
      blocks.back().score += row * value;
    }
  }
  information_ = H;
  scatter_ = score_scatter(blocks, H);
  *d = -ldlt_solve(H, g);
  return d->allFinite();
}

void Fit::report(const Mat3& nominal, Mount* mount) const {
  // Use the larger of the error model's sigma and the scatter between blocks, because the
  // estimate's drift is not a Gauss–Markov process.
  const Information covariance = ldlt_inverse(information_);
  const Information by_blocks = covariance * scatter_ * covariance;
  const auto sigma = [&](int p) {
    return std::sqrt(std::max({0.0, covariance(p, p), by_blocks(p, p)}));
  };
  const Vec3 turn = log_so3(state_.R_m * nominal.transpose());
  Mount m;
  Vec3 seen = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    m.rotation[i] = {sigma(mount_rotation + k) <= options_.rotation_sigma, turn[k],
                     sigma(mount_rotation + k)};
    m.lever_arm[i] = {sigma(lever + k) <= options_.lever_sigma, state_.lever[k], sigma(lever + k)};
    if (m.rotation[i].observable) seen[k] = turn[k];
    if (m.lever_arm[i].observable) m.T_ref_est.t[k] = state_.lever[k];
  }
  m.T_ref_est.R = exp_so3(seen) * nominal;
  m.clock_offset = {sigma(clock) <= options_.offset_sigma.to_seconds(), state_.offset,
                    sigma(clock)};
  m.moments = moments_.size();
  std::vector<Errors> all;
  if (all_errors(state_, &all)) {
    double rotation = 0, position = 0;
    for (const Errors& e : all) {
      rotation += e.segment<3>(0).squaredNorm() / static_cast<double>(all.size());
      position += e.segment<3>(3).squaredNorm() / static_cast<double>(all.size());
    }
    m.residual_rotation = std::sqrt(rotation);
    m.residual_position = std::sqrt(position);
  }
  *mount = m;
}

/// Iterates the fit. Returns false if it does not converge or its clock offset is at the limit.
bool Fit::settle() {
  // Maximum clock offset in s, within the range of the moments.
  constexpr double kLargest = 0.3;
  // Convergence limit, in sigmas.
  constexpr double kSettled = 1e-2;
  for (int round = 0; round < kMountRounds; ++round) {
    Parameters d;
    if (!step(&d)) return false;
    state_ = moved(state_, d);
    state_.offset = std::clamp(state_.offset, -kLargest, kLargest);
    // Minimum number of rounds, to estimate correlations.
    constexpr int kMinRounds = 6;
    if (round >= kMinRounds && d.dot(information_ * d) < kSettled * kSettled)
      return std::abs(state_.offset) < kLargest;
  }
  return false;
}

MountStatus Fit::run(const Mat3& nominal, Mount* mount) {
  if (!start(nominal)) return MountStatus::no_motion;
  if (!settle()) return MountStatus::not_converged;
  Mount found;
  report(nominal, &found);
  // Errors are linearised as small rotations; the neglected half square must be below the limit of
  // an observable rotation.
  if (found.residual_rotation * found.residual_rotation / 2 > options_.rotation_sigma)
    return MountStatus::not_converged;
  *mount = found;
  return MountStatus::ok;
}

}  // namespace

MountStatus estimate_ins_extrinsics(std::span<const StampedPose> estimate,
                                    std::span<const MountReference> reference, const Mat3& nominal,
                                    const MountOptions& options, Mount* mount) {
  if (estimate.size() < kMountMoments || reference.size() < 2) return MountStatus::too_few;
  const Duration interval = median_interval(reference);
  MountOptions spaced = options;
  spaced.step = moment_spacing(interval, options.step);
  std::vector<Moment> moments = select_moments(estimate, reference, interval, spaced);
  // Error correlation is estimated between consecutive moments; too few would show none.
  const auto following =
      std::count_if(moments.begin(), moments.end(), [](const Moment& m) { return m.follows; });
  if (static_cast<std::size_t>(following) < kMountMoments) return MountStatus::too_few;
  return Fit(std::move(moments), estimate, spaced).run(nominal, mount);
}

}  // namespace vergence
