#include "core/geometry/mlesac.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/camera/camera.hpp"
#include "core/geometry/detail/buckets.hpp"
#include "core/geometry/detail/kernels.hpp"
#include "core/geometry/three_point.hpp"

namespace vergence {
namespace {

constexpr const char* kWho = "rig MLESAC";
// Number of observations, a multiple of the block, after which scoring checks whether the
// hypothesis has already lost.
constexpr std::size_t kAbortChunk = 64;
// Number of Gauss–Newton steps on inliers, from a pose with an error of a few sigmas.
constexpr int kPolishSteps = 3;
// Maximum number of refined hypotheses per solve; there are about log(hypotheses).
constexpr int kMaxPolished = 12;
// Huber's threshold in sigmas: inliers are cut at T², so none is down-weighted.
constexpr double kNoHuber = 1e6;

[[nodiscard]] bool valid(const MlesacOptions& o) noexcept {
  return o.max_hypotheses >= 1 && o.min_hypotheses >= 0 && o.confidence > 0 && o.confidence < 1 &&
         o.outlier_cost > 0 && std::isfinite(o.outlier_cost);
}

}  // namespace

int samples_needed(double inliers, int size, double confidence, int cap) noexcept {
  const double clean = std::pow(std::clamp(inliers, 0.0, 1.0), size);
  if (clean >= 1.0 - 1e-12) return 1;
  if (clean <= 1e-12) return cap;
  const double n = std::log(1.0 - confidence) / std::log1p(-clean);
  return n >= cap ? cap : std::max(1, static_cast<int>(std::ceil(n)));
}

RigMlesac::RigMlesac(std::size_t capacity, Arena& arena)
    : problem_(capacity, arena, kWho), flags_(arena.make<std::uint8_t>(capacity, kWho)) {
  const std::size_t n = detail::padded(capacity, detail::kFloatBlock);
  for (CameraSet& s : sets_) {
    for (std::span<float>* column : {&s.x, &s.y, &s.z, &s.u, &s.v, &s.weight, &s.cap})
      *column = arena.make<float>(n, kWho);
    s.point = arena.make<std::uint32_t>(n, kWho);
    s.bucket = arena.make<std::uint8_t>(n, kWho);
  }
}

void RigMlesac::gather(const RigObservations& o, double cap) noexcept {
  points_ = o.size();
  observations_ = 0;
  Vec3 sum = Vec3::Zero();
  std::size_t finite = 0;
  for (std::size_t i = 0; i < points_; ++i) {
    const Vec3 p(o.x[i], o.y[i], o.z[i]);
    if (!p.allFinite()) continue;
    sum += p;
    ++finite;
  }
  centre_ =
      finite > 0 && sum.allFinite() ? Vec3(sum / static_cast<double>(finite)) : Vec3(Vec3::Zero());
  for (int k = 0; k < kMaxCameras; ++k) {
    CameraSet& s = sets_[static_cast<std::size_t>(k)];
    s.count = s.scored = 0;
    if (k >= o.cameras) continue;
    const auto kk = static_cast<std::size_t>(k);
    detail::PixelBox box;
    for (std::size_t i = 0; i < points_; ++i) {
      if (!o.usable(i, k)) continue;
      const std::size_t n = s.count++;
      s.point[n] = static_cast<std::uint32_t>(i);
      s.x[n] = static_cast<float>(o.x[i] - centre_.x());
      s.y[n] = static_cast<float>(o.y[i] - centre_.y());
      s.z[n] = static_cast<float>(o.z[i] - centre_.z());
      s.u[n] = static_cast<float>(o.u[kk][i] - o.pinhole[kk].cx);
      s.v[n] = static_cast<float>(o.v[kk][i] - o.pinhole[kk].cy);
      s.weight[n] = static_cast<float>(1.0 / (o.sigma[i] * o.sigma[i]));
      s.cap[n] = static_cast<float>(cap);
      box.include(o.u[kk][i], o.v[kk][i]);
    }
    for (std::size_t n = 0; n < s.count; ++n)
      s.bucket[n] = box.bucket(o.u[kk][s.point[n]], o.v[kk][s.point[n]]);
    s.scored = detail::padded(s.count, detail::kFloatBlock);
    for (std::size_t n = s.count; n < s.scored; ++n)
      s.x[n] = s.y[n] = s.z[n] = s.u[n] = s.v[n] = s.weight[n] = s.cap[n] = 0.0F;
    observations_ += static_cast<int>(s.count);
  }
}

bool RigMlesac::draw(const CameraSet& set, Random& random,
                     std::array<std::uint32_t, 3>* picks) const noexcept {
  return detail::draw_spread<3>(set.bucket.first(set.count), random, picks);
}

double RigMlesac::score(const RigObservations& o, const Transform& T_left_world,
                        double best) const noexcept {
  double cost = 0;
  for (int k = 0; k < o.cameras; ++k) {
    const auto kk = static_cast<std::size_t>(k);
    const CameraSet& s = sets_[kk];
    if (s.count == 0) continue;
    const Mat3 R = o.T_camera_left[kk].R * T_left_world.R;
    const Vec3 t = o.T_camera_left[kk] * (T_left_world.R * centre_ + T_left_world.t);
    const Pinhole& c = o.pinhole[kk];
    const Vec3 gain(c.fx, c.fy, 1.0);
    detail::ProjectionRows rows;
    for (int r = 0; r < 3; ++r) {
      for (int j = 0; j < 3; ++j)
        rows[static_cast<std::size_t>(4 * r + j)] = static_cast<float>(gain[r] * R(r, j));
      rows[static_cast<std::size_t>(4 * r + 3)] = static_cast<float>(gain[r] * t[r]);
    }
    const detail::ScoreColumns columns{s.x.data(), s.y.data(),      s.z.data(),  s.u.data(),
                                       s.v.data(), s.weight.data(), s.cap.data()};
    for (std::size_t first = 0; first < s.scored; first += kAbortChunk) {
      cost += static_cast<double>(detail::projection_cost(columns, first,
                                                          std::min(first + kAbortChunk, s.scored),
                                                          rows, static_cast<float>(kMinDepth)));
      if (!(cost < best)) return std::numeric_limits<double>::infinity();
    }
  }
  return cost;
}

void RigMlesac::flag(const RigObservations& o, double cap, MlesacPose* pose) noexcept {
  std::fill_n(flags_.begin(), points_, std::uint8_t{0});
  pose->inlier_observations = 0;
  for (int k = 0; k < o.cameras; ++k) {
    const auto kk = static_cast<std::size_t>(k);
    const CameraSet& s = sets_[kk];
    const Transform T_camera_world = o.T_camera_left[kk] * pose->T_left_world;
    const Pinhole& c = o.pinhole[kk];
    for (std::size_t n = 0; n < s.count; ++n) {
      const std::size_t i = s.point[n];
      const Vec3 p = T_camera_world * Vec3(o.x[i], o.y[i], o.z[i]);
      if (!(p.z() > kMinDepth)) continue;
      const double iz = 1.0 / p.z();
      const double du = c.fx * p.x() * iz + c.cx - o.u[kk][i],
                   dv = c.fy * p.y() * iz + c.cy - o.v[kk][i];
      if (!(du * du + dv * dv < cap * o.sigma[i] * o.sigma[i])) continue;
      flags_[i] = static_cast<std::uint8_t>(flags_[i] | (1U << kk));
      ++pose->inlier_observations;
    }
  }
  pose->inliers = 0;
  for (std::size_t i = 0; i < points_; ++i)
    pose->inliers += flags_[i] != 0 && flags_[i] == o.seen[i] ? 1 : 0;
}

bool RigMlesac::polish(double cap, Transform* T) noexcept {
  Transform next = *T;
  for (int step = 0; step < kPolishSteps; ++step) {
    problem_.evaluate(next);
    for (int k = 0; k < problem_.cameras(); ++k) {
      const std::span<const double> errors = problem_.errors(k);
      for (std::size_t i = 0; i < errors.size(); ++i) problem_.use(k, i, errors[i] < cap);
    }
    const detail::PoseProblem::Sums sums = problem_.sums(next, 1.0, kNoHuber);
    Vec6 delta;
    if (!detail::solve_normal(sums.H, sums.g, &delta)) return false;
    next = detail::moved(next, delta);
  }
  if (!next.finite()) return false;
  *T = next;
  return true;
}

MlesacPose RigMlesac::solve(const RigObservations& o, const MlesacOptions& options,
                            const Transform* prior, Random& random) noexcept {
  MlesacPose out;
  points_ = 0;
  if (!valid(options) || !o.consistent() || o.size() > flags_.size()) return out;
  const double cap = options.outlier_cost;
  gather(o, cap);
  problem_.gather(o);
  const bool has_prior = prior != nullptr && prior->finite();
  // Number of observations in cameras that have at least three.
  int drawable = 0;
  for (const CameraSet& s : sets_) drawable += s.count >= 3 ? static_cast<int>(s.count) : 0;
  if (observations_ == 0 || (drawable == 0 && !has_prior)) {
    std::fill_n(flags_.begin(), points_, std::uint8_t{0});
    return out;
  }

  double best = std::numeric_limits<double>::infinity();
  int polished = 0;
  int needed = drawable > 0 ? options.max_hypotheses : 0;
  const auto consider = [&](const Transform& T) noexcept {
    const double cost = score(o, T, best);
    if (!(cost < best)) return;
    best = cost;
    out.found = true;
    out.T_left_world = T;
    Transform better = T;
    if (polished < kMaxPolished && polish(cap, &better)) {
      ++polished;
      const double polished_cost = score(o, better, best);
      if (polished_cost < best) {
        best = polished_cost;
        out.T_left_world = better;
      }
    }
    flag(o, cap, &out);
    const double share = static_cast<double>(out.inlier_observations) / observations_;
    needed = drawable > 0
                 ? std::max(std::min(options.min_hypotheses, options.max_hypotheses),
                            samples_needed(share, 3, options.confidence, options.max_hypotheses))
                 : 0;
  };
  if (has_prior) consider(*prior);

  while (out.samples < needed) {
    ++out.samples;
    // Choose a camera in proportion to its observations.
    int ticket = static_cast<int>(random.below(static_cast<std::uint32_t>(drawable)));
    std::size_t k = 0;
    for (; k + 1 < sets_.size(); ++k) {
      const int share = sets_[k].count >= 3 ? static_cast<int>(sets_[k].count) : 0;
      if (ticket < share) break;
      ticket -= share;
    }
    const CameraSet& s = sets_[k];
    std::array<std::uint32_t, 3> picks{};
    if (!draw(s, random, &picks)) continue;
    std::array<Vec3, 3> rays, points;
    const Pinhole& c = o.pinhole[k];
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t i = s.point[picks[j]];
      rays[j] = Vec3((o.u[k][i] - c.cx) / c.fx, (o.v[k][i] - c.cy) / c.fy, 1.0).normalized();
      points[j] = Vec3(o.x[i], o.y[i], o.z[i]);
    }
    const ThreePointSolutions found = solve_three_point(rays, points);
    const Transform T_left_camera = o.T_camera_left[k].inverse();
    for (int j = 0; j < found.count; ++j)
      consider(T_left_camera * found.T_camera_world[static_cast<std::size_t>(j)]);
  }
  if (!out.found) std::fill_n(flags_.begin(), points_, std::uint8_t{0});
  return out;
}

}  // namespace vergence
