#include "core/geometry/stereo_mlesac.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/detail/buckets.hpp"
#include "core/geometry/detail/kernels.hpp"
#include "core/geometry/five_point.hpp"
#include "core/geometry/mlesac.hpp"
#include "core/math/linear_solve.hpp"

namespace vergence {
namespace {

constexpr const char* kWho = "stereo MLESAC";
// Number of matches, a multiple of the block, between checks against the best score.
constexpr std::size_t kAbortChunk = 128;
// Widening of T² for each Gauss–Newton step, because a sample's noise hides good matches at first.
constexpr std::array kPolishWidths = {9.0, 4.0, 1.0, 1.0, 1.0};
// Maximum number of refined hypotheses per call; there are about log(hypotheses).
constexpr int kMaxPolished = 12;
// Maximum condition of the information; above it double precision does not resolve the worst
// direction.
constexpr double kMaxCondition = 1e12;

[[nodiscard]] bool valid(const StereoMatches& m, double baseline,
                         const StereoMlesacOptions& o) noexcept {
  const std::size_t n = m.size();
  return m.left_y.size() == n && m.right_x.size() == n && m.right_y.size() == n &&
         m.sigma.size() == n && baseline > 0 && std::isfinite(baseline) && o.max_hypotheses >= 1 &&
         o.min_hypotheses >= 0 && o.confidence > 0 && o.confidence < 1 && o.outlier_cost > 0 &&
         std::isfinite(o.outlier_cost);
}

/// True if a match is in front of both cameras, or so far away that noise decides the sign of its
/// depth.
[[nodiscard]] bool in_front(const Transform& T, const Vec2& left, const Vec2& right,
                            double inverse_sigma, double cap) noexcept {
  double depth_left = 0, depth_right = 0;
  if (match_depths(T, left, right, &depth_left, &depth_right) && depth_left > 0 && depth_right > 0)
    return true;
  const Vec3 turned = T.R * left.homogeneous();
  if (!(turned.z() > 0)) return false;
  const double gap = (turned.head<2>() / turned.z() - right).norm() * inverse_sigma;
  // The noise of both rays adds up.
  return gap * gap < 2.0 * cap;
}

}  // namespace

StereoMlesac::StereoMlesac(std::size_t capacity, Arena& arena) {
  const std::size_t n = detail::padded(capacity, detail::kFloatBlock);
  for (std::span<float>* column : {&x1_, &y1_, &x2_, &y2_, &weight_, &cap_})
    *column = arena.make<float>(n, kWho);
  for (std::span<Vec2>* rays : {&left_, &right_, &near_left_, &near_right_})
    *rays = arena.make<Vec2>(n, kWho);
  inverse_sigma_ = arena.make<double>(n, kWho);
  match_ = arena.make<std::uint32_t>(n, kWho);
  bucket_ = arena.make<std::uint8_t>(n, kWho);
  flags_ = arena.make<std::uint8_t>(capacity, kWho);
}

void StereoMlesac::gather(const StereoMatches& m, double cap) noexcept {
  matches_ = m.size();
  count_ = 0;
  detail::PixelBox box;
  for (std::size_t i = 0; i < matches_; ++i) {
    const Vec2 l(m.left_x[i], m.left_y[i]), r(m.right_x[i], m.right_y[i]);
    if (!l.allFinite() || !r.allFinite() || !(m.sigma[i] > 0) || !std::isfinite(m.sigma[i]))
      continue;
    const std::size_t n = count_++;
    left_[n] = l;
    right_[n] = r;
    inverse_sigma_[n] = 1.0 / m.sigma[i];
    match_[n] = static_cast<std::uint32_t>(i);
    x1_[n] = static_cast<float>(l.x());
    y1_[n] = static_cast<float>(l.y());
    x2_[n] = static_cast<float>(r.x());
    y2_[n] = static_cast<float>(r.y());
    weight_[n] = static_cast<float>(inverse_sigma_[n] * inverse_sigma_[n]);
    cap_[n] = static_cast<float>(cap);
    box.include(l.x(), l.y());
  }
  for (std::size_t n = 0; n < count_; ++n) bucket_[n] = box.bucket(left_[n].x(), left_[n].y());
  whole_ = detail::padded(count_, detail::kFloatBlock);
  for (std::size_t n = count_; n < whole_; ++n)
    x1_[n] = y1_[n] = x2_[n] = y2_[n] = weight_[n] = cap_[n] = 0.0F;
}

double StereoMlesac::score(const Mat3& E, double best) const noexcept {
  std::array<float, 9> e;
  for (std::size_t i = 0; i < 9; ++i)
    e[i] = static_cast<float>(E(static_cast<int>(i / 3), static_cast<int>(i % 3)));
  const detail::MatchColumns columns{x1_.data(), y1_.data(),     x2_.data(),
                                     y2_.data(), weight_.data(), cap_.data()};
  double cost = 0;
  for (std::size_t first = 0; first < whole_; first += kAbortChunk) {
    cost += static_cast<double>(
        detail::sampson_cost(columns, first, std::min(first + kAbortChunk, whole_), e));
    if (!(cost < best)) return std::numeric_limits<double>::infinity();
  }
  return cost;
}

bool StereoMlesac::best_transform(const Mat3& E, double cap, double baseline,
                                  Transform* T) noexcept {
  std::size_t n = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 x = left_[i].homogeneous(), y = right_[i].homogeneous();
    const Vec3 l = E * x, k = E.transpose() * y;
    const double d = y.dot(l) * inverse_sigma_[i];
    if (!(d * d < cap * (l.head<2>().squaredNorm() + k.head<2>().squaredNorm()))) continue;
    near_left_[n] = left_[i];
    near_right_[n++] = right_[i];
  }
  return decompose_essential(E, near_left_.first(n), near_right_.first(n), baseline, T) > 0;
}

Mat5 StereoMlesac::information(double cap, const Transform& T, Vec5* gradient) const noexcept {
  const EpipolarGeometry geometry(T);
  Mat5 H = Mat5::Zero();
  *gradient = Vec5::Zero();
  for (std::size_t i = 0; i < count_; ++i) {
    double r = 0;
    Vec5 J;
    if (!geometry.sampson(left_[i], right_[i], &r, &J)) continue;
    r *= inverse_sigma_[i];
    // A wrong match near its line has a large disparity and therefore a strong influence on t, but
    // half of those are behind a camera.
    if (!(r * r < cap) || !in_front(T, left_[i], right_[i], inverse_sigma_[i], cap)) continue;
    J *= inverse_sigma_[i];
    H.noalias() += J * J.transpose();
    *gradient -= r * J;
  }
  return H;
}

bool StereoMlesac::polish(double cap, Transform* T) const noexcept {
  Transform next = *T;
  for (const double width : kPolishWidths) {
    Vec5 g;
    const Mat5 H = information(width * cap, next, &g);
    const Cholesky<5> llt(H);
    if (!llt.ok()) return false;
    const Vec5 delta = llt.solve(g);
    if (!delta.allFinite() || !(delta.norm() < 1.0)) return false;
    next = moved_on_sphere(next, delta);
  }
  *T = next;
  return true;
}

int StereoMlesac::flag(double cap, const Transform& T) noexcept {
  std::fill_n(flags_.begin(), matches_, std::uint8_t{0});
  const EpipolarGeometry geometry(T);
  int inliers = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    double r = 0;
    if (!geometry.sampson(left_[i], right_[i], &r, nullptr)) continue;
    r *= inverse_sigma_[i];
    if (!(r * r < cap)) continue;
    if (!in_front(T, left_[i], right_[i], inverse_sigma_[i], cap)) continue;
    flags_[match_[i]] = 1;
    ++inliers;
  }
  return inliers;
}

StereoEstimate StereoMlesac::estimate_stereo_transform(const StereoMatches& matches,
                                                       double baseline,
                                                       const StereoMlesacOptions& options,
                                                       Random& random) noexcept {
  StereoEstimate out;
  matches_ = 0;
  if (!valid(matches, baseline, options) || matches.size() > flags_.size()) return out;
  const double cap = options.outlier_cost;
  gather(matches, cap);
  std::fill_n(flags_.begin(), matches_, std::uint8_t{0});
  if (count_ < 5) return out;

  double best = std::numeric_limits<double>::infinity();
  int needed = options.max_hypotheses, polished = 0;
  while (out.samples < needed) {
    ++out.samples;
    std::array<std::uint32_t, 5> picks{};
    if (!detail::draw_spread<5>(bucket_.first(count_), random, &picks)) continue;
    std::array<Vec2, 5> left, right;
    for (std::size_t j = 0; j < 5; ++j) left[j] = left_[picks[j]], right[j] = right_[picks[j]];
    const FivePointSolutions found = solve_five_point(left, right);
    for (int j = 0; j < found.count; ++j) {
      const Mat3& E = found.E[static_cast<std::size_t>(j)];
      const double cost = score(E, best);
      Transform T;
      if (!(cost < best) || !best_transform(E, cap, baseline, &T)) continue;
      best = cost;
      Transform better = T;
      if (polished < kMaxPolished && polish(cap, &better)) {
        ++polished;
        // The distances do not depend on the sign of t, so the depths are checked again with the
        // better E.
        const Mat3 E_better = essential_matrix(better);
        const double polished_cost = score(E_better, best);
        if (polished_cost < best && best_transform(E_better, cap, baseline, &better))
          best = polished_cost, T = better;
      }
      out.found = true;
      out.T_right_left = T;
      out.inliers = flag(cap, T);
      needed =
          std::max(std::min(options.min_hypotheses, options.max_hypotheses),
                   samples_needed(static_cast<double>(out.inliers) / static_cast<double>(count_), 5,
                                  options.confidence, options.max_hypotheses));
    }
  }
  if (!out.found) return out;
  Vec5 unused;
  out.information = information(cap, out.T_right_left, &unused);
  out.direction_sigma = std::numeric_limits<double>::infinity();
  const Vec5 along = semidefinite_eigenvalues(out.information);
  const Cholesky<5> factor(out.information);
  if (along[4] > along[0] / kMaxCondition && factor.ok()) {
    const Mat5 covariance = factor.inverse();
    const Mat2 direction = covariance.bottomRightCorner<2, 2>();
    out.direction_sigma = std::sqrt(semidefinite_eigenvalues(direction)[0]);
  }
  return out;
}

}  // namespace vergence
