// One step of the adjuster against the same step computed the long way: residuals through
// Camera::project, every derivative a central difference, the normal equations dense and undivided.
// It checks each Jacobian, each weight and each block of the normal equations (core/README.md).
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

using Vector = Eigen::VectorXd;

std::array<double*, 9> parameters(Intrinsics* k) {
  auto& d = k->distortion;
  return {&k->fx, &k->fy, &k->cx, &k->cy, &d[0], &d[1], &d[2], &d[3], &d[4]};
}

/// The parameters of one problem and how a vector moves them, written down independently of the
/// adjuster.
struct Dense {
  SimulatedRig rig;
  BundleOptions options;

  [[nodiscard]] bool calibrating() const {
    return options.configuration == BundleConfiguration::stereo_calibration;
  }
  [[nodiscard]] Eigen::Index size() const {
    Eigen::Index n =
        static_cast<Eigen::Index>(6 * (rig.T_left_world.size() - 1) + 3 * rig.points.size());
    if (!calibrating()) return n;
    for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
      if (k > 0) n += options.length[k].kind == BundleLength::exact ? 5 : 6;
      n += std::popcount(options.intrinsics[k].free);
    }
    return n;
  }

  [[nodiscard]] SimulatedRig moved(const Vector& v) const {
    SimulatedRig out = rig;
    Eigen::Index at = 0;
    const auto next3 = [&] {
      const Vec3 x = v.segment<3>(at);
      at += 3;
      return x;
    };
    for (std::size_t i = 1; i < out.T_left_world.size(); ++i) {
      const Mat3 turn = exp_so3(next3());
      out.T_left_world[i] = {turn * rig.T_left_world[i].R, turn * rig.T_left_world[i].t + next3()};
    }
    for (Vec3& p : out.points) p += next3();
    if (!calibrating()) return out;
    for (std::size_t k = 0; k < out.cameras.size(); ++k) {
      if (k > 0) {
        Transform& T = out.T_camera_left[k];
        T.R = exp_so3(next3()) * T.R;
        if (options.length[k].kind == BundleLength::exact) {
          const Vec3 u = T.t.normalized(), a = u.unitOrthogonal(), b = u.cross(a);
          T.t = (T.t + v[at] * a + v[at + 1] * b).normalized() * T.t.norm();
          at += 2;
        } else {
          T.t += next3();
        }
      }
      Intrinsics in = out.cameras[k].intrinsics();
      const auto all = parameters(&in);
      for (unsigned i = 0; i < 9; ++i)
        if (((options.intrinsics[k].free >> i) & 1U) != 0) *all[i] += v[at++];
      out.cameras[k] = Camera(in);
    }
    return out;
  }

  /// Whitened residuals of the observations, then of the priors.
  [[nodiscard]] Vector residuals(const Vector& v) const {
    const SimulatedRig at = moved(v);
    std::vector<double> e;
    for (const BundleObservation& o : at.observations) {
      Vec2 pixel;
      EXPECT_EQ(at.cameras[o.camera].project(
                    at.T_camera_left[o.camera] * (at.T_left_world[o.pose] * at.points[o.point]),
                    &pixel, nullptr),
                ProjectStatus::ok);
      e.push_back((pixel.x() - o.x) * o.inverse_sigma);
      e.push_back((pixel.y() - o.y) * o.inverse_sigma);
    }
    if (calibrating())
      for (std::size_t k = 0; k < at.cameras.size(); ++k) {
        if (k > 0 && options.length[k].kind == BundleLength::measured)
          e.push_back((at.T_camera_left[k].t.norm() - options.length[k].metres) /
                      options.length[k].sigma);
        Intrinsics in = at.cameras[k].intrinsics();
        const auto all = parameters(&in);
        for (unsigned i = 0; i < 9; ++i)
          if (((options.intrinsics[k].free >> i) & 1U) != 0 &&
              options.intrinsics[k].prior_sigma[i] > 0)
            e.push_back((*all[i] - options.intrinsics[k].prior_mean[i]) /
                        options.intrinsics[k].prior_sigma[i]);
      }
    return Eigen::Map<const Vector>(e.data(), static_cast<Eigen::Index>(e.size()));
  }

  [[nodiscard]] SimulatedRig step() const {
    const Vector zero = Vector::Zero(size()), e = residuals(zero);
    Eigen::MatrixXd J(e.size(), size());
    for (Eigen::Index i = 0; i < size(); ++i) {
      const double h = 1e-6;
      J.col(i) =
          (residuals(Vector::Unit(size(), i) * h) - residuals(Vector::Unit(size(), i) * -h)) /
          (2 * h);
    }
    Vector weight = Vector::Ones(e.size());
    const double c2 = options.loss_threshold * options.loss_threshold;
    for (Eigen::Index i = 0; i < 2 * static_cast<Eigen::Index>(rig.observations.size()); i += 2) {
      const double s = e.segment<2>(i).squaredNorm();
      if (options.loss == BundleLoss::huber && s > c2)
        weight.segment<2>(i).setConstant(std::sqrt(c2 / s));
      if (options.loss == BundleLoss::cauchy) weight.segment<2>(i).setConstant(1 / (1 + s / c2));
    }
    const Eigen::MatrixXd H = J.transpose() * weight.asDiagonal() * J;
    // Scaled to a unit diagonal: pixels of focal length and coefficients of r⁶ stand in one system.
    const Vector scale = H.diagonal().cwiseSqrt().cwiseInverse();
    const Vector g = scale.asDiagonal() * (J.transpose() * (weight.asDiagonal() * e));
    return moved(
        -(scale.asDiagonal() * (scale.asDiagonal() * H * scale.asDiagonal()).ldlt().solve(g)));
  }
};

struct Case {
  const char* name;
  int cameras = 2;
  BundleLength length = BundleLength::exact;
  BundleLoss loss = BundleLoss::none;
  CameraModelKind kind = CameraModelKind::pinhole_radtan;
  std::array<double, 5> distortion{};
  // Free intrinsics of every camera.
  unsigned free = 0;
  BundleConfiguration configuration = BundleConfiguration::stereo_calibration;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class DenseReference : public ::testing::TestWithParam<Case> {};

TEST_P(DenseReference, oneStepMatchesTheDenseStep) {
  const Case& c = GetParam();
  SimulationOptions s{.cameras = c.cameras, .poses = 4, .points = 12, .noise = 0.5};
  s.start_position = s.start_points = 0.01;
  s.start_rotation = 0.002;
  s.start_translation = 0.005;
  Random random(51);
  Dense d;
  d.rig = simulate_rig(s, random);
  d.options.configuration = c.configuration;
  d.options.loss = c.loss;
  for (std::size_t k = 0; k < static_cast<std::size_t>(c.cameras); ++k) {
    Intrinsics in = d.rig.cameras[k].intrinsics();
    in.kind = c.kind;
    in.distortion = c.distortion;
    in.fy *= 1.01;
    d.rig.cameras[k] = Camera(in);
    d.options.intrinsics[k].free = static_cast<std::uint16_t>(c.free);
    d.options.intrinsics[k].prior_mean = {in.fx + 1, in.fy - 1, in.cx, in.cy, 0, 0, 0, 0, 0};
    d.options.intrinsics[k].prior_sigma = {2, 2, 3, 3, 0.1, 0.1, 0.01, 0.01, 0.1};
    d.options.length[k] = {k > 1 ? BundleLength::free : c.length,
                           c.length == BundleLength::measured ? 0.8 : 0.0, 0.01};
  }
  // The truth is seen through this lens. The noise is small against the curvature.
  for (BundleObservation& o : d.rig.observations) {
    Vec2 pixel;
    ASSERT_EQ(
        d.rig.cameras[o.camera].project(
            d.rig.true_cameras[o.camera] * (d.rig.true_poses[o.pose] * d.rig.true_points[o.point]),
            &pixel, nullptr),
        ProjectStatus::ok);
    o.x = pixel.x() + 0.5 * random.normal();
    o.y = pixel.y() + 0.5 * random.normal();
  }
  if (!d.calibrating()) d.rig.T_camera_left = d.rig.true_cameras;
  const SimulatedRig expected = d.step();

  SimulatedRig rig = d.rig;
  BundleOptions o = d.options;
  o.max_steps = 1;
  o.initial_damping = 1e-11;
  OwnAdjuster own(capacities_for(s));
  const BundleResult r = own.adjuster.solve(rig.problem(), o);
  ASSERT_EQ(r.accepted, 1);
  // Central differences with h = 1e-6 of residuals near 1000 px carry 1e-7; weak directions (depth,
  // focal length) amplify it.
  for (std::size_t i = 0; i < rig.points.size(); ++i)
    EXPECT_LT((rig.points[i] - expected.points[i]).norm(),
              1e-4 * (d.rig.points[i] - expected.points[i]).norm() + 1e-7)
        << "point " << i;
  for (std::size_t i = 1; i < rig.T_left_world.size(); ++i) {
    EXPECT_LT((rig.T_left_world[i].t - expected.T_left_world[i].t).norm(),
              1e-4 * (d.rig.T_left_world[i].t - expected.T_left_world[i].t).norm() + 1e-7)
        << "pose " << i;
    EXPECT_LT(rotation_angle(rig.T_left_world[i].R * expected.T_left_world[i].R.transpose()), 1e-7)
        << "pose " << i;
  }
  for (std::size_t k = 1; k < rig.cameras.size(); ++k) {
    // The second-order part of the way t and R are moved may differ: the step is 1e-3 long.
    EXPECT_LT((rig.T_camera_left[k].t - expected.T_camera_left[k].t).norm(),
              1e-4 * (d.rig.T_camera_left[k].t - expected.T_camera_left[k].t).norm() + 1e-7);
    EXPECT_LT(rotation_angle(rig.T_camera_left[k].R * expected.T_camera_left[k].R.transpose()),
              1e-7)
        << "camera " << k;
  }
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    const Intrinsics &a = rig.cameras[k].intrinsics(), &b = expected.cameras[k].intrinsics();
    EXPECT_NEAR(a.fx, b.fx, 1e-3);
    EXPECT_NEAR(a.cy, b.cy, 1e-3);
    for (std::size_t i = 0; i < 5; ++i)
      EXPECT_NEAR(
          a.distortion[i], b.distortion[i],
          1e-4 * (1e-2 + std::abs(d.rig.cameras[k].intrinsics().distortion[i] - b.distortion[i])));
  }
}

constexpr auto kMeasured = BundleLength::measured, kExact = BundleLength::exact;
constexpr auto kNone = BundleLoss::none, kHuber = BundleLoss::huber, kCauchy = BundleLoss::cauchy;
constexpr auto kRadtan = CameraModelKind::pinhole_radtan,
               kFisheye = CameraModelKind::pinhole_equidistant;
constexpr auto kOdometry = BundleConfiguration::stereo_odometry;
constexpr std::array<double, 5> kBent{-0.1, 0.02, 1e-3, -2e-3, 0.01},
    kWide{-0.02, 0.01, -0.005, 0.001, 0};

INSTANTIATE_TEST_SUITE_P(
    Every, DenseReference,
    ::testing::Values(Case{"pinholeExact"}, Case{"pinholeMeasured", 2, kMeasured, kHuber},
                      Case{"threeCamerasCauchy", 3, kExact, kCauchy},
                      Case{"fourCameras", 4, kMeasured},
                      Case{"focalLengths", 2, kExact, kNone, kRadtan, {}, 0b11},
                      Case{"radtanAll", 2, kExact, kNone, kRadtan, kBent, 0b111111111},
                      Case{"equidistantAll", 3, kMeasured, kCauchy, kFisheye, kWide, 0b011111111},
                      Case{"radtanHeld", 2, kExact, kHuber, kRadtan, kBent},
                      Case{"odometry", 2, kExact, kHuber, kRadtan, {}, 0, kOdometry},
                      Case{"odometryEquidistant", 3, kExact, kNone, kFisheye, kWide, 0, kOdometry}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace vergence
