#include "app/devices/rig_settings.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "app/devices/mock_drive.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

const std::string kTwo = "cameras: [{driver: mock}, {driver: mock}]\ntrigger: {driver: mock}\n";

Configuration configured(const std::vector<std::string>& set) {
  return parse_configuration(kTwo, "test", set);
}

std::string refusal(const std::vector<std::string>& set) {
  return test::refusal_of([&] { (void)nominal_rig(configured(set)); });
}

void expect_equal(const RigCalibration& a, const RigCalibration& b) {
  ASSERT_EQ(a.cameras, b.cameras);
  EXPECT_EQ(a.baseline, b.baseline);
  for (std::size_t k = 0; k < static_cast<std::size_t>(a.cameras); ++k) {
    const Intrinsics &i = a.intrinsics[k], &j = b.intrinsics[k];
    EXPECT_EQ(std::vector({i.fx, i.fy, i.cx, i.cy}), std::vector({j.fx, j.fy, j.cx, j.cy}));
    EXPECT_EQ(i.distortion, j.distortion);
    EXPECT_EQ(a.T_camera_left[k].R, b.T_camera_left[k].R);
    EXPECT_EQ(a.T_camera_left[k].t, b.T_camera_left[k].t);
  }
}

TEST(RigSettings, aCamerasOwnNumbersGoBeforeThoseOfTheRig) {
  const RigCalibration rig = mounted_rig(
      configured({"rig.nominal.k1=-0.1", "cameras.1.intrinsics=[500, 501, 322, 241]",
                  "cameras.1.distortion=[-0.2, 0.05, 0.001]",
                  "cameras.1.T_camera_left=[0, -1, 0, -0.4, 1, 0, 0, -0.3, 0, 0, 1, 0]"}));
  EXPECT_EQ(rig.intrinsics[0].distortion[0], -0.1);
  EXPECT_EQ(rig.intrinsics[1].fy, 501);
  EXPECT_EQ(rig.intrinsics[1].cx, 322);
  EXPECT_EQ(rig.intrinsics[1].distortion, (std::array<double, 5>{-0.2, 0.05, 0.001, 0, 0}));
  EXPECT_EQ(rig.T_camera_left[1].t, Vec3(-0.4, -0.3, 0));
  EXPECT_EQ(rig.T_camera_left[1].R(1, 0), 1);
  EXPECT_DOUBLE_EQ(rig.baseline, 0.5);
}

TEST(RigSettings, intrinsicsErrorsHaveTheirSigmasAndTheirSeed) {
  const std::vector<std::string> errors{"mock.intrinsics_error.principal_point_px=0.5",
                                        "mock.intrinsics_error.focal_percent=0.1"};
  double centre = 0, focal = 0;
  constexpr int kSeeds = 500;
  for (int seed = 0; seed < kSeeds; ++seed) {
    auto set = errors;
    set.push_back("mock.intrinsics_error.seed=" + std::to_string(seed));
    const Configuration c = configured(set);
    const RigCalibration given = nominal_rig(c), mounted = mounted_rig(c);
    for (std::size_t k = 0; k < 2; ++k) {
      const Intrinsics &g = given.intrinsics[k], &m = mounted.intrinsics[k];
      centre += std::pow(g.cx - m.cx, 2) + std::pow(g.cy - m.cy, 2);
      focal += std::pow(g.fx / m.fx - 1, 2);
      EXPECT_NEAR(g.fx / m.fx, g.fy / m.fy, 1e-15);
      EXPECT_NE(g.cx, m.cx);
    }
    EXPECT_NE(given.intrinsics[0].cx, given.intrinsics[1].cx);
    if (seed == 7) expect_equal(given, nominal_rig(configured(set)));
  }
  // A sigma from n draws is known to 1/√(2n): 2000 and 1000 draws; five of those.
  EXPECT_NEAR(std::sqrt(centre / (4 * kSeeds)), 0.5, 0.5 * 5 / std::sqrt(4000.0));
  EXPECT_NEAR(std::sqrt(focal / (2 * kSeeds)), 1e-3, 1e-3 * 5 / std::sqrt(2000.0));
}

TEST(RigSettings, renderedRigAndTruthRigHaveNoErrors) {
  const Configuration c =
      configured({"mock.intrinsics_error.principal_point_px=2", "mock.calibration_error.yaw_deg=1",
                  "mock.texture_detail=0", "mock.drive=still"});
  const auto drive = make_mock_drive(c, {"knock@5 camera=1 pitch_deg=0.2"}, false, 1.0);
  expect_equal(drive->truth().mounted(), mounted_rig(c));
  expect_equal(drive->truth().calibration(Duration::seconds(4)), mounted_rig(c));
  const Transform moved = drive->truth().calibration(Duration::seconds(6)).T_camera_left[1] *
                          mounted_rig(c).T_camera_left[1].inverse();
  EXPECT_NEAR(log_so3(moved.R).x(), 0.2 * std::numbers::pi / 180, 1e-12);
}

TEST(RigSettings, impossibleRigsAreRefusedByTheirKeys) {
  struct Bad {
    std::vector<std::string> set;
    const char* mentions;
  };
  for (const Bad& bad : {
           Bad{{"cameras.1.intrinsics=[460, 460]"}, "cameras.1.intrinsics is ["},
           Bad{{"cameras.1.intrinsics=[0, 460, 300, 200]"}, "cameras.1.intrinsics is ["},
           Bad{{"cameras.1.intrinsics=[460, 460, 0, 200]"}, "cameras.1.intrinsics is ["},
           Bad{{"cameras.1.intrinsics=[460, 0, 300, 200]"}, "cameras.1.intrinsics is ["},
           Bad{{"cameras.0.distortion=[-0.2, 0.05]"}, "set without cameras.0.intrinsics"},
           Bad{{"cameras.1.model=pinhole-equidistant", "cameras.1.intrinsics=[300, 301, 322, 241]",
                "cameras.1.distortion=[0, 0, 0, 0, 0.01]"},
               "cameras.1.distortion has five"},
           Bad{{"cameras.1.T_camera_left=[1, 0, 0, 0.75, 0, 1, 0, 0, 0, 0, 1, 0]"},
               "left and right are swapped"},
           Bad{{"mock.calibration_error.x_m=0.3"}, "mock.calibration_error"},
           Bad{{"cameras.3.driver=mock"}, "before it has none"},
       })
    EXPECT_TRUE(test::mentions(refusal(bad.set), bad.mentions)) << bad.set[0];
}

}  // namespace
}  // namespace vergence::app
