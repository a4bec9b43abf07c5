#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "drivers/mock/world/detail/town.hpp"

namespace vergence::mock {
namespace {

/// Length of a whole wave in m; the north-south streets lie on its level places.
constexpr double kHillLength = 300.0;
/// Every ground texture repeats with this period in m.
constexpr double kTexturePeriod = 16.0;

double amplitude(double hill_deg) noexcept {
  return std::tan(hill_deg * std::numbers::pi / 180.0) * kHillLength / (2 * std::numbers::pi);
}

/// Sun from the north-east over an even sky; the ground receives about 1.15.
float shade(const Vec3& normal) noexcept {
  static const Vec3 sun = Vec3(0.40, 0.50, 0.77).normalized();
  return static_cast<float>(0.60 + 0.72 * std::max(0.0, normal.dot(sun)));
}

/// Keeps the part with sign · (x − cut) >= 0.
std::vector<Vec2> clipped(std::span<const Vec2> in, double cut, double sign) {
  std::vector<Vec2> out;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Vec2 &a = in[i], &b = in[(i + 1) % in.size()];
    const double da = sign * (a.x() - cut), db = sign * (b.x() - cut);
    if (da >= 0) out.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) out.push_back(a + da / (da - db) * (b - a));
  }
  return out;
}

double area(std::span<const Vec2> p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec2 &a = p[i], &b = p[(i + 1) % p.size()];
    sum += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return sum;
}

}  // namespace

double smooth_ground(double hill_deg, double x) noexcept {
  return amplitude(hill_deg) *
         (1.0 - std::cos(2 * std::numbers::pi * std::clamp(x, kWorldX0, kWorldX1) / kHillLength));
}

double smooth_ground_slope(double hill_deg, double x) noexcept {
  if (x <= kWorldX0 || x >= kWorldX1) return 0.0;
  const double k = 2 * std::numbers::pi / kHillLength;
  return amplitude(hill_deg) * k * std::sin(k * x);
}

double drawn_ground(double hill_deg, double x) noexcept {
  const double cell = std::floor(x / kGroundStep), s = x / kGroundStep - cell;
  const double a = smooth_ground(hill_deg, cell * kGroundStep),
               b = smooth_ground(hill_deg, (cell + 1) * kGroundStep);
  return a + s * (b - a);
}

void SceneBuilder::begin() { first_ = scene_->polygons.size(); }

void SceneBuilder::end() {
  Object object{first_, scene_->polygons.size() - first_, Vec3::Zero(), 0};
  if (object.count == 0) return;
  Vec3 lo = Vec3::Constant(1e30), hi = -lo;
  for (std::size_t i = first_; i < scene_->polygons.size(); ++i)
    for (int k = 0; k < scene_->polygons[i].count; ++k) {
      lo = lo.cwiseMin(scene_->polygons[i].corners[static_cast<std::size_t>(k)]);
      hi = hi.cwiseMax(scene_->polygons[i].corners[static_cast<std::size_t>(k)]);
    }
  object.centre = 0.5 * (lo + hi);
  object.radius = 0.5 * (hi - lo).norm();
  scene_->objects.push_back(object);
}

void SceneBuilder::push(const Polygon& polygon) { scene_->polygons.push_back(polygon); }

void SceneBuilder::ground_polygon(std::span<const Vec2> outline, double lift_m, int material,
                                  float light) {
  double x0 = 1e30, x1 = -1e30;
  for (const Vec2& p : outline) {
    x0 = std::min(x0, p.x());
    x1 = std::max(x1, p.x());
  }
  x0 = std::max(x0, -1e4);
  const Material& m = scene_->materials[static_cast<std::size_t>(material)];
  // Beyond the built world the ground is level: one piece.
  std::vector<double> cuts{x0};
  for (double cut = std::max(kWorldX0, std::floor(x0 / kGroundStep + 1) * kGroundStep);
       cut < std::min(x1, kWorldX1 + 1e-9); cut += kGroundStep)
    if (cut > x0) cuts.push_back(cut);
  cuts.push_back(x1);
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const auto piece = clipped(clipped(outline, cuts[i], 1.0), cuts[i + 1], -1.0);
    if (piece.size() < 3 || area(piece) < 1e-6) continue;
    const double mid = 0.5 * (cuts[i] + cuts[i + 1]);
    const double slope = (ground(std::min(cuts[i + 1], mid + 1e-3)) - ground(mid)) /
                         (std::min(cuts[i + 1], mid + 1e-3) - mid);
    const auto height = [&](double x) { return ground(mid) + slope * (x - mid) + lift_m; };
    Polygon p;
    p.normal = Vec3(-slope, 0, 1).normalized();
    p.material = material;
    p.light = light * shade(p.normal);
    const Vec2 origin(kTexturePeriod * std::floor(piece[0].x() / kTexturePeriod),
                      kTexturePeriod * std::floor(piece[0].y() / kTexturePeriod));
    p.texture_origin = {origin.x(), origin.y(), height(origin.x())};
    p.axis_u = Vec3::UnitX() * m.texels_per_metre_u;
    p.axis_v = Vec3::UnitY() * m.texels_per_metre_v;
    begin();
    // The polygon becomes a fan of quads, the last of which may be a triangle.
    for (std::size_t k = 1; k + 1 < piece.size();) {
      p.count = 3;
      p.corners[0] = {piece[0].x(), piece[0].y(), height(piece[0].x())};
      p.corners[1] = {piece[k].x(), piece[k].y(), height(piece[k].x())};
      p.corners[2] = {piece[k + 1].x(), piece[k + 1].y(), height(piece[k + 1].x())};
      ++k;
      if (k + 1 < piece.size()) {
        p.count = 4;
        p.corners[3] = {piece[k + 1].x(), piece[k + 1].y(), height(piece[k + 1].x())};
        ++k;
      }
      push(p);
    }
    end();
  }
}

void SceneBuilder::kerb(const Vec2& a, const Vec2& b) {
  const double length = (b - a).norm();
  if (length < 1e-6) return;
  std::vector<double> cuts{0.0};
  const double dx = b.x() - a.x();
  if (std::abs(dx) > 1e-9)
    for (double x = std::ceil(std::min(a.x(), b.x()) / kGroundStep) * kGroundStep;
         x < std::max(a.x(), b.x()); x += kGroundStep) {
      const double s = (x - a.x()) / dx;
      if (s > 1e-6 && s < 1 - 1e-6) cuts.push_back(s);
    }
  cuts.push_back(1.0);
  std::sort(cuts.begin(), cuts.end());
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const Vec2 p = a + cuts[i] * (b - a), q = a + cuts[i + 1] * (b - a);
    const std::array<Vec3, 4> corners{
        Vec3(p.x(), p.y(), ground(p.x())), Vec3(q.x(), q.y(), ground(q.x())),
        Vec3(q.x(), q.y(), ground(q.x()) + kKerb), Vec3(p.x(), p.y(), ground(p.x()) + kKerb)};
    begin();
    flat(corners, {material::concrete, 0.8F, cuts[i] * length, 0});
    end();
  }
}

void SceneBuilder::flat(std::span<const Vec3> corners, const Face& face, bool two_sided) {
  assert(corners.size() == 3 || corners.size() == 4);
  const Material& m = scene_->materials[static_cast<std::size_t>(face.material)];
  Polygon p;
  p.count = static_cast<int>(corners.size());
  std::copy(corners.begin(), corners.end(), p.corners.begin());
  const Vec3 along = (corners[1] - corners[0]).normalized();
  p.normal = along.cross(corners[corners.size() - 1] - corners[0]).normalized();
  const Vec3 up = p.normal.cross(along);
  p.two_sided = two_sided;
  p.material = face.material;
  p.light = face.light * shade(p.normal);
  p.texture_origin = corners[0] - face.u_offset_m * along - face.v_offset_m * up;
  p.axis_u = along * m.texels_per_metre_u;
  p.axis_v = up * m.texels_per_metre_v;
  push(p);
}

void SceneBuilder::textured_quad(std::span<const Vec3> corners, int material, float light,
                                 double span_u, double span_v) {
  flat(corners, {material, light, 0, 0}, true);
  Polygon& p = scene_->polygons.back();
  const Material& m = scene_->materials[static_cast<std::size_t>(material)];
  p.light = light;
  p.axis_u = p.axis_u.normalized() * (std::ldexp(1.0, m.brightness.log2_width) / span_u);
  p.axis_v = p.axis_v.normalized() * (std::ldexp(1.0, m.brightness.log2_height) / span_v);
}

void SceneBuilder::box(const Box& b, const Face& front_back, const Face& sides, const Face* top) {
  const Vec3 a(b.along.x() * b.half_length, b.along.y() * b.half_length, 0);
  // The normal is to the right of `along`.
  const Vec3 n(b.along.y() * b.half_width, -b.along.x() * b.half_width, 0);
  const Vec3 up(0, 0, b.height);
  // The corners are counter-clockwise from above.
  const std::array<Vec3, 4> base{b.base - a + n, b.base + a + n, b.base + a - n, b.base - a - n};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 &p = base[i], &q = base[(i + 1) % 4];
    flat(std::array<Vec3, 4>{p, q, q + up, p + up}, i % 2 == 0 ? front_back : sides);
  }
  if (top != nullptr)
    flat(std::array<Vec3, 4>{base[0] + up, base[1] + up, base[2] + up, base[3] + up}, *top);
}

}  // namespace vergence::mock
