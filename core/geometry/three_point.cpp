#include "core/geometry/three_point.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/detail/polynomial.hpp"

namespace vergence {
namespace {

// Tolerance of |ray|² − 1, to detect rays that are not normalised.
constexpr double kUnitTolerance = 1e-6;
// Minimum sin² between two rays: 0.02″, far below the resolution of pixels.
constexpr double kMinRaySine2 = 1e-14;
// Minimum sin² of a corner of the world triangle; below it the frame is noise.
constexpr double kMinTriangleSine2 = 1e-12;
// Number of Newton steps; two reach rounding from an error of 1e-8.
constexpr int kPolishSteps = 3;
// Maximum error of a squared side after refinement, relative to the sum of the squared sides.
constexpr double kMaxRelativeMisfit = 1e-9;

/// A symmetric 3×3 form q(λ) = λᵀ M λ.
struct Quadric {
  double xx, xy, xz, yy, yz, zz;
  [[nodiscard]] Vec3 times(const Vec3& v) const noexcept {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
  [[nodiscard]] Vec3 row0() const noexcept { return {xx, xy, xz}; }
  [[nodiscard]] Vec3 row1() const noexcept { return {xy, yy, yz}; }
  [[nodiscard]] Vec3 row2() const noexcept { return {xz, yz, zz}; }
  [[nodiscard]] Quadric adjugate() const noexcept {
    return {yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy,
            xx * zz - xz * xz, xz * xy - xx * yz, xx * yy - xy * xy};
  }
  /// tr(M N), the coupling coefficient of two forms in a pencil's determinant.
  [[nodiscard]] double dot(const Quadric& o) const noexcept {
    return xx * o.xx + yy * o.yy + zz * o.zz + 2.0 * (xy * o.xy + xz * o.xz + yz * o.yz);
  }
};

[[nodiscard]] Quadric combination(const Quadric& a, double s, const Quadric& b) noexcept {
  return {a.xx + s * b.xx, a.xy + s * b.xy, a.xz + s * b.xz,
          a.yy + s * b.yy, a.yz + s * b.yz, a.zz + s * b.zz};
}

/// Sides of both triangles: cosines between rays, squared lengths between points.
struct Sides {
  double cos01, cos02, cos12;
  // |ray_i − ray_j|² = 2 − 2 cos, without cancellation for narrow angles.
  double gap01, gap02, gap12;
  // Squared lengths over their sum, because the problem has no scale of its own.
  double a01, a02, a12;
};

/// Refines depths to satisfy the three squared sides (λ_i − λ_j)² + λ_i λ_j gap_ij = a_ij, by
/// Newton's method with the inverse of the 3×3 Jacobian by cofactors.
[[nodiscard]] bool polish(const Sides& s, Vec3* depths) noexcept {
  Vec3 l = *depths;
  const auto residuals = [&s](const Vec3& d) noexcept {
    const double d01 = d[0] - d[1], d02 = d[0] - d[2], d12 = d[1] - d[2];
    return Vec3(d01 * d01 + d[0] * d[1] * s.gap01 - s.a01,
                d02 * d02 + d[0] * d[2] * s.gap02 - s.a02,
                d12 * d12 + d[1] * d[2] * s.gap12 - s.a12);
  };
  Vec3 r = residuals(l);
  for (int step = 0; step < kPolishSteps; ++step) {
    const double d01 = 2.0 * (l[0] - l[1]), d02 = 2.0 * (l[0] - l[2]), d12 = 2.0 * (l[1] - l[2]);
    const double j00 = d01 + s.gap01 * l[1], j01 = s.gap01 * l[0] - d01;
    const double j10 = d02 + s.gap02 * l[2], j12 = s.gap02 * l[0] - d02;
    const double j21 = d12 + s.gap12 * l[2], j22 = s.gap12 * l[1] - d12;
    const double det = -j00 * j12 * j21 - j01 * j10 * j22;
    // At a double root, keep the start.
    if (det == 0.0) break;
    const double i = 1.0 / det;
    const Vec3 next(l[0] - i * (-j12 * j21 * r[0] - j01 * j22 * r[1] + j01 * j12 * r[2]),
                    l[1] - i * (-j10 * j22 * r[0] + j00 * j22 * r[1] - j00 * j12 * r[2]),
                    l[2] - i * (j10 * j21 * r[0] - j00 * j21 * r[1] - j01 * j10 * r[2]));
    const Vec3 after = residuals(next);
    // Rounding is reached, or the value is NaN.
    if (!(after.squaredNorm() < r.squaredNorm())) break;
    l = next;
    r = after;
  }
  if (!(r.cwiseAbs().maxCoeff() < kMaxRelativeMisfit)) return false;
  *depths = l;
  return l.minCoeff() > 0.0;
}

/// Frame with columns along e1, in the plane of e1 and e2, and normal to both. Precondition: e1 ×
/// e2 ≠ 0.
[[nodiscard]] Mat3 triangle_frame(const Vec3& e1, const Vec3& e2) noexcept {
  const Vec3 x = e1 * (1.0 / std::sqrt(e1.squaredNorm()));
  const Vec3 c = x.cross(e2);
  const Vec3 z = c * (1.0 / std::sqrt(c.squaredNorm()));
  Mat3 F;
  F << x, z.cross(x), z;
  return F;
}

/// Null vector of a singular form: the longest cross product of its rows.
[[nodiscard]] bool null_vector(const Quadric& q, Vec3* v) noexcept {
  const Vec3 a = q.row0().cross(q.row1()), b = q.row0().cross(q.row2()),
             c = q.row1().cross(q.row2());
  const double na = a.squaredNorm(), nb = b.squaredNorm(), nc = c.squaredNorm();
  const double n = std::max({na, nb, nc});
  if (!(n > 0.0)) return false;
  *v = (na == n ? a : nb == n ? b : c) * (1.0 / std::sqrt(n));
  return true;
}

/// Any unit vector perpendicular to a unit vector.
[[nodiscard]] Vec3 perpendicular(const Vec3& v) noexcept {
  const Vec3 a = v.cwiseAbs();
  const Vec3 p = a.x() <= a.y() && a.x() <= a.z() ? Vec3(0, -v.z(), v.y())
                 : a.y() <= a.z()                 ? Vec3(v.z(), 0, -v.x())
                                                  : Vec3(-v.y(), v.x(), 0);
  return p * (1.0 / std::sqrt(p.squaredNorm()));
}

/// Directions λ (up to sign) in which two conics intersect; at most four. The pencil's member first
/// + γ second is singular.
int meet(const Quadric& first, const Quadric& second, double gamma,
         std::array<Vec3, 4>* directions) noexcept {
  const Quadric split = combination(first, gamma, second);
  Vec3 apex;
  if (!null_vector(split, &apex)) return 0;
  // Eigenvectors in the plane perpendicular to the apex, by one Jacobi rotation.
  const Vec3 f = perpendicular(apex), g = apex.cross(f);
  const Vec3 Mf = split.times(f), Mg = split.times(g);
  const double ff = f.dot(Mf), fg = f.dot(Mg), gg = g.dot(Mg);
  const double mean = 0.5 * (ff + gg), half = 0.5 * (ff - gg);
  const double radius = std::sqrt(half * half + fg * fg);
  const double high = mean + radius, low = mean - radius;
  // Eigenvalues of one sign give two complex planes without a common direction.
  if (!(high > 0.0) || !(low < 0.0)) return 0;
  Vec3 e_high = half >= 0 ? Vec3((half + radius) * f + fg * g) : Vec3(fg * f + (radius - half) * g);
  e_high *= 1.0 / std::sqrt(e_high.squaredNorm());
  const Vec3 e_low = apex.cross(e_high);
  // high (e_high·λ)² + low (e_low·λ)² = 0 gives the planes √high e_high·λ = ±√−low e_low·λ.
  const double root_high = std::sqrt(high), root_low = std::sqrt(-low);
  // On the planes first = −γ second, so the larger one is more accurate.
  const Quadric& other = std::abs(gamma) > 1.0 ? first : second;
  const Vec3 M_apex = other.times(apex);
  const double uu = apex.dot(M_apex);
  int n = 0;
  for (const double sign : {1.0, -1.0}) {
    // This vector and the apex span the plane.
    const Vec3 v = sign * root_low * e_high + root_high * e_low;
    const double uv = v.dot(M_apex), vv = v.dot(other.times(v));
    // uu α² + 2 uv αβ + vv β² = 0 in homogeneous (α, β), the stable pair of roots.
    double discriminant = uv * uv - uu * vv;
    if (discriminant < 0.0) {
      if (discriminant < -1e-12 * (uv * uv + std::abs(uu * vv))) continue;
      // This is a double root, apart from rounding.
      discriminant = 0.0;
    }
    const double q = uv >= 0 ? -uv - std::sqrt(discriminant) : -uv + std::sqrt(discriminant);
    (*directions)[static_cast<std::size_t>(n++)] = q * apex + uu * v;
    (*directions)[static_cast<std::size_t>(n++)] = vv * apex + q * v;
  }
  return n;
}

}  // namespace

ThreePointSolutions solve_three_point(const std::array<Vec3, 3>& rays,
                                      const std::array<Vec3, 3>& points) noexcept {
  ThreePointSolutions out;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!rays[i].allFinite() || !points[i].allFinite()) return out;
    if (!(std::abs(rays[i].squaredNorm() - 1.0) < kUnitTolerance)) return out;
  }
  const Vec3 p01 = points[1] - points[0], p02 = points[2] - points[0], p12 = points[2] - points[1];
  Sides s{rays[0].dot(rays[1]),
          rays[0].dot(rays[2]),
          rays[1].dot(rays[2]),
          (rays[0] - rays[1]).squaredNorm(),
          (rays[0] - rays[2]).squaredNorm(),
          (rays[1] - rays[2]).squaredNorm(),
          p01.squaredNorm(),
          p02.squaredNorm(),
          p12.squaredNorm()};
  if (std::min({rays[0].cross(rays[1]).squaredNorm(), rays[0].cross(rays[2]).squaredNorm(),
                rays[1].cross(rays[2]).squaredNorm()}) < kMinRaySine2)
    return out;
  const double sum = s.a01 + s.a02 + s.a12;
  if (!std::isfinite(sum)) return out;
  const double longest = std::max({s.a01, s.a02, s.a12}),
               shortest = std::min({s.a01, s.a02, s.a12});
  // |p01 × p02|² = (twice the area)². With two longer sides of about equal length it is longest ×
  // shortest × sin² of a corner.
  if (!(p01.cross(p02).squaredNorm() > kMinTriangleSine2 * longest * shortest) ||
      !(shortest > 1e-24 * longest))
    return out;
  const double scale = 1.0 / sum;
  s.a01 *= scale, s.a02 *= scale, s.a12 *= scale;

  // D1 = a12 M01 − a01 M12, D2 = a12 M02 − a02 M12, with λᵀ M_ij λ = λ_i² + λ_j² − 2 cos_ij λ_i
  // λ_j.
  const Quadric D1{s.a12, -s.a12 * s.cos01, 0.0, s.a12 - s.a01, s.a01 * s.cos12, -s.a01};
  const Quadric D2{s.a12, 0.0, -s.a12 * s.cos02, -s.a02, s.a02 * s.cos12, s.a12 - s.a02};
  const Quadric adj1 = D1.adjugate(), adj2 = D2.adjugate();
  // det(D1 + γ D2) as a cubic in γ: det M = row0 · first column of the adjugate.
  const double c0 = D1.xx * adj1.xx + D1.xy * adj1.xy, c3 = D2.xx * adj2.xx + D2.xz * adj2.xz;
  const double c1 = adj1.dot(D2), c2 = adj2.dot(D1);

  // If the leading coefficient is small, reverse the pencil: 1/γ is a root of the reversed cubic.
  std::array<Vec3, 4> directions;
  int n = 0;
  if (std::abs(c3) >= std::abs(c0))
    n = meet(D1, D2, detail::sharpest_cubic_root(c3, c2, c1, c0), &directions);
  else
    n = meet(D2, D1, detail::sharpest_cubic_root(c0, c1, c2, c3), &directions);

  // The frames of the two triangles satisfy F_camera = R F_world.
  const Mat3 F_world = triangle_frame(p01, p02);
  const double length = std::sqrt(sum);
  std::array<Vec3, 4> found;
  for (int i = 0; i < n; ++i) {
    Vec3 l = directions[static_cast<std::size_t>(i)];
    if (l.sum() < 0.0) l = -l;
    const double largest = l.maxCoeff();
    if (!(l.minCoeff() > -1e-6 * largest) || !(largest > 0.0)) continue;
    // The sum of the three sides, which is 1, determines the length of λ.
    const double q = 2.0 * (l.squaredNorm() - s.cos01 * l[0] * l[1] - s.cos02 * l[0] * l[2] -
                            s.cos12 * l[1] * l[2]);
    if (!(q > 0.0)) continue;
    l *= 1.0 / std::sqrt(q);
    if (!polish(s, &l)) continue;
    bool seen = false;
    for (int j = 0; j < out.count; ++j)
      seen =
          seen || (found[static_cast<std::size_t>(j)] - l).squaredNorm() < 1e-20 * l.squaredNorm();
    if (seen) continue;
    const Vec3 x0 = l[0] * rays[0], x1 = l[1] * rays[1], x2 = l[2] * rays[2];
    Transform T;
    T.R.noalias() = triangle_frame(x1 - x0, x2 - x0) * F_world.transpose();
    // The translation through the centroid uses all three points.
    T.t = (length / 3.0) * (x0 + x1 + x2) - T.R * ((points[0] + points[1] + points[2]) / 3.0);
    if (!T.finite()) continue;
    found[static_cast<std::size_t>(out.count)] = l;
    out.T_camera_world[static_cast<std::size_t>(out.count++)] = T;
  }
  return out;
}

}  // namespace vergence
