#include "app/config/calibration_covariance.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

const std::string kRig = R"(version: 1
rig: {name: demo, baseline: 0.75}
cameras:
  - {name: left, size: [1024, 768], model: pinhole-radtan, intrinsics: [980, 981, 512, 384]}
  - {name: right, size: [1024, 768], model: pinhole-equidistant, intrinsics: [982, 983, 510, 380], T_camera_left: [1, 0, 0, -0.75, 0, 1, 0, 0, 0, 0, 1, 0]}
)";

std::string with_block(const std::string& parameters, const std::string& upper) {
  return kRig + "covariance:\n  parameters: " + parameters + "\n  upper: " + upper + "\n";
}

std::string refusal(const std::string& yaml) {
  return test::refusal_of([&] { (void)parse_calibration(yaml, "c.yaml"); });
}

/// Rows of both cameras that a drive estimates, one combination of them exactly known, as with a
/// baseline of known length.
RigCovariance singular(const std::vector<int>& rows) {
  Random random(5);
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd root(n, n - 1);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n - 1; ++j)
      root(i, j) = std::pow(10.0, -static_cast<double>(i % 6)) * (random.uniform() - 0.5);
  const Eigen::MatrixXd C = root * root.transpose();
  RigCovariance covariance;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      covariance.set(rows[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(j)], C(i, j));
  return covariance;
}

CalibrationFile example() {
  CalibrationFile c = parse_calibration(kRig, "c.yaml");
  c.rig.covariance = singular({extrinsic_row(1), extrinsic_row(1) + 3, extrinsic_row(1) + 5,
                               intrinsic_row(0) + 4, intrinsic_row(0) + 8, intrinsic_row(1),
                               intrinsic_row(1) + 2, intrinsic_row(1) + 7});
  return c;
}

void expect_same(const RigCovariance& a, const RigCovariance& b) {
  for (int i = 0; i < kRigSize; ++i)
    for (int j = 0; j <= i; ++j) EXPECT_EQ(a(i, j), b(i, j)) << i << " " << j;
}

TEST(CalibrationCovariance, rowsGoByCameraAndParameter) {
  const RigCalibration rig =
      parse_calibration(with_block("[left.k1, right.rx, right.k4, left.k3]",
                                   "[4e-4, 1e-6, 0, 0, 1e-6, 0, 0, 9e-4, 0, 1e-4]"),
                        "c.yaml")
          .rig;
  EXPECT_EQ(rig.covariance(intrinsic_row(0) + 4, intrinsic_row(0) + 4), 4e-4);
  EXPECT_EQ(rig.covariance(extrinsic_row(1), intrinsic_row(0) + 4), 1e-6);
  EXPECT_EQ(rig.covariance(intrinsic_row(1) + 7, intrinsic_row(1) + 7), 9e-4)
      << "k4 of an equidistant lens";
  EXPECT_EQ(rig.covariance(intrinsic_row(0) + 8, intrinsic_row(0) + 8), 1e-4)
      << "k3 of a radtan one";
  EXPECT_FALSE(rig.covariance.known(extrinsic_row(1) + 1));
}

TEST(CalibrationCovariance, writtenCovarianceReadsBackExactly) {
  const CalibrationFile before = example();
  const std::string text = format_calibration(before);
  EXPECT_NE(text.find("parameters: [right.rx, right.tx, right.tz, left.k1, left.k3, right.fx, "
                      "right.cx, right.k4]"),
            std::string::npos);
  expect_same(parse_calibration(text, "c.yaml").rig.covariance, before.rig.covariance);
  EXPECT_EQ(format_calibration(parse_calibration(text, "c.yaml")), text);
}

TEST(CalibrationCovariance, wrongCovarianceIsRefusedWithReason) {
  const std::string two = "[right.rx, right.ry]";
  struct Row {
    std::string yaml, beginning, mentions = "";
  };
  for (const Row& r : std::vector<Row>{
           {with_block("[right.rx, rihgt.ry]", "[1, 0, 1]"),
            "c.yaml:7: covariance.parameters has \"rihgt.ry\"", "did you mean \"right.ry\"?"},
           // The left camera has no extrinsics.
           {with_block("[left.rx]", "[1]"), "c.yaml:7: covariance.parameters has \"left.rx\"",
            "not a parameter"},
           // An equidistant lens has no p1.
           {with_block("[right.p1]", "[1]"), "c.yaml:7: covariance.parameters", "not a parameter"},
           {with_block("[right.rx, 1.rx]", "[1, 0, 1]"),
            "c.yaml:7: covariance.parameters has 1.rx twice"},
           {with_block("[]", "[]"), "c.yaml:7: covariance.parameters is not a list of parameters"},
           {with_block("right.rx", "[1]"),
            "c.yaml:7: covariance.parameters is not a list of parameters"},
           {with_block("[[right.rx]]", "[1]"), "c.yaml:7: covariance.parameters is not a text"},
           {with_block(two, "[1, 0]"), "c.yaml:8: covariance.upper has 2 numbers; it needs 3"},
           {with_block(two, "[1, .nan, 1]"), "c.yaml:8: covariance.upper", "finite"},
           {with_block(two, "[1, 0, -1]"),
            "c.yaml:8: covariance.upper has -1 as the variance of right.ry"},
           {with_block(two, "[1, 0, 0]"),
            "c.yaml:8: covariance.upper has 0 as the variance of right.ry"},
           {with_block(two, "[1, 1.1, 1]"), "c.yaml:7: covariance has a correlation beyond 1"},
           {with_block("[right.rx, right.ry, right.rz]", "[1, 0.9, -0.9, 1, 0.9, 1]"),
            "c.yaml:7: covariance is not positive"},
           {kRig + "covariance: {parameters: [right.rx]}\n",
            "c.yaml:6: covariance.upper is missing"},
           {kRig + "covariance: 3\n", "c.yaml:6: covariance is not a group"},
           {kRig + "covariance: {parameter: [right.rx], upper: [1]}\n",
            "c.yaml:6: covariance has the unknown key"},
       }) {
    const std::string message = refusal(r.yaml);
    EXPECT_TRUE(message.starts_with(r.beginning) && test::contains(message, r.mentions)) << message;
  }
}

TEST(CalibrationCovariance, scratchKeepsLensesAndDropsPlaces) {
  const RigCalibration before = example().rig;
  RigCalibration rig = before;
  rig.inflation = 3;
  apply_use({.length_only = true}, &rig);
  const int rx = extrinsic_row(1), k1 = intrinsic_row(0) + 4, fx = intrinsic_row(1);
  EXPECT_FALSE(rig.covariance.known(rx));
  EXPECT_EQ(rig.covariance(rx, fx), 0);
  EXPECT_EQ(rig.covariance(k1, fx), before.covariance(k1, fx));
  EXPECT_EQ(rig.inflation, 0);
  EXPECT_FALSE(find_flaw(rig.covariance));
}

}  // namespace
}  // namespace vergence::app
