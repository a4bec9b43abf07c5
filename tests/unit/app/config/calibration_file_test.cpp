#include "app/config/calibration_file.hpp"

#include <tuple>

#include "app/config/calibration_checks.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

const std::string kGood = R"(version: 1
rig: {name: demo, baseline: 0.750702, baseline_sigma: 0.0005}
cameras:
  - {name: left, serial: "15021234", size: [1024, 768], model: pinhole-radtan, intrinsics: [980, 981, 512, 384], distortion: [-0.28, 0.07, 1e-4, 2e-5], intrinsics_sigma: [1.2, 1.2, 0.5, 0.5]}
  - name: right
    size: [1024, 768]
    model: pinhole-radtan
    intrinsics: [982, 983, 510, 380]
    distortion: [-0.28, 0.07, 1e-4, 2e-5, 0.01]
    T_camera_left: [1, 0, 0, -0.75, 0, 1, 0, 0.01, 0, 0, 1, 0.02]
    sigma_noise: [1e-4, 2e-4, 3e-4, 1e-3, 2e-3, 3e-3]
found: {stamp: 1403636584763555584, source: online, frames: 60, reprojection_px: 0.18, scale_sigma: 0.0021}
)";

/// The good file with one part replaced; the part must be there.
std::string with(const std::string& part, const std::string& replacement) {
  std::string text = kGood;
  const auto at = text.find(part);
  if (at == std::string::npos) throw std::logic_error("not in the file: " + part);
  return text.replace(at, part.size(), replacement);
}

std::string refusal(const std::string& yaml) {
  return test::refusal_of([&] { (void)parse_calibration(yaml, "c.yaml"); });
}

TEST(CalibrationFile, documentedFormIsRead) {
  const CalibrationFile c = parse_calibration(kGood, "c.yaml");
  EXPECT_EQ(c.rig_name, "demo");
  EXPECT_EQ(c.names[1], "right");
  EXPECT_EQ(c.serials[0], "15021234");
  EXPECT_EQ(c.source, "online");
  const RigCalibration& rig = c.rig;
  EXPECT_EQ(rig.cameras, 2);
  EXPECT_EQ(rig.baseline, 0.750702);
  EXPECT_EQ(rig.intrinsics[0].width, 1024);
  EXPECT_EQ(rig.intrinsics[0].sigma[3], 0.5);
  EXPECT_EQ(rig.intrinsics[1].cy, 380);
  EXPECT_EQ(rig.intrinsics[1].distortion[4], 0.01);
  EXPECT_EQ(rig.T_camera_left[1].t, Vec3(-0.75, 0.01, 0.02));
  EXPECT_EQ(rig.sigma_noise[1][5], 3e-3);
  EXPECT_EQ(rig.sigma_total[1][5], 0.0);
  EXPECT_EQ(rig.found, Stamp(1403636584763555584));
  EXPECT_EQ(rig.frames, 60);
}

/// A rig of four with every field set to numbers that need all their digits.
CalibrationFile awkward() {
  Random random(7);
  CalibrationFile c{.rig_name = "the \"blue\" van: № 3\n", .names = {"left", "true", "12", ""}};
  c.serials = {"0123", "", "a b", "0x1f"};
  c.source = "online";
  c.rig.cameras = 4;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto number = [&random](double size) { return size * (random.uniform() - 0.5); };
    Intrinsics& i = c.rig.intrinsics[k];
    i.kind = k % 2 == 0 ? CameraModelKind::pinhole_radtan : CameraModelKind::pinhole_equidistant;
    i.width = 1024, i.height = 768;
    i.fx = 980 + number(1), i.fy = 980 + number(1);
    i.cx = 512 + number(1), i.cy = 384 + number(1);
    for (std::size_t d = 0; d < (k == 0 ? 5U : 4U); ++d) i.distortion[d] = number(0.1);
    i.sigma = {number(1) + 1, 1e-300, 1.0 / 3.0, 0.1};
    for (std::size_t d = 0; d < (k == 0 ? 5U : 4U); ++d)
      i.distortion_sigma[d] = number(0.01) + 0.01;
    if (k == 0) continue;
    c.rig.T_camera_left[k] = {exp_so3(Vec3(number(0.2), number(0.2), number(0.2))),
                              Vec3(-0.75 + number(0.1), number(0.1), number(0.1))};
    for (std::size_t j = 0; j < 6; ++j)
      c.rig.sigma_noise[k][j] = (c.rig.sigma_total[k][j] = number(1e-3) + 1e-3) / 3.0;
    Mat6 root;
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 6; ++column) root(row, column) = number(1e-3);
    const Mat6 product = root * root.transpose();
    c.rig.covariance_total[k] = product.selfadjointView<Eigen::Upper>();
  }
  c.rig.baseline = c.rig.T_camera_left[1].t.norm() * 1.001;
  c.rig.baseline_sigma = 1e-3 / 7.0;
  c.rig.found = Stamp(1403636584763555584);
  c.rig.frames = 61;
  c.rig.reprojection_px = 0.1 + 0.2;
  c.rig.scale_sigma = 2.1e-3 / 3.0;
  c.rig.inflation = 7.0 / 3.0;
  return c;
}

TEST(CalibrationFile, writtenFileReadsBackExactly) {
  const test::TemporaryFolder folder;
  const CalibrationFile before = awkward();
  write_calibration(folder / "c.yaml", before);
  const CalibrationFile after = read_calibration(folder / "c.yaml");
  const auto words = [](const CalibrationFile& c) {
    return std::tie(c.rig_name, c.names, c.serials, c.source);
  };
  EXPECT_EQ(words(after), words(before));
  ASSERT_EQ(after.rig.cameras, 4);
  for (std::size_t k = 0; k < 4; ++k) {
    SCOPED_TRACE(k);
    const auto lens = [k](const CalibrationFile& c) {
      const Intrinsics& i = c.rig.intrinsics[k];
      return std::tie(i.kind, i.width, i.height, i.fx, i.fy, i.cx, i.cy, i.distortion, i.sigma,
                      i.distortion_sigma);
    };
    EXPECT_TRUE(lens(after) == lens(before));
    const auto place = [k](const CalibrationFile& c) {
      const RigCalibration& r = c.rig;
      return std::tie(r.T_camera_left[k].R, r.T_camera_left[k].t, r.sigma_noise[k],
                      r.sigma_total[k], r.covariance_total[k]);
    };
    EXPECT_TRUE(place(after) == place(before));
  }
  const auto figures = [](const CalibrationFile& c) {
    const RigCalibration& r = c.rig;
    return std::tie(r.baseline, r.baseline_sigma, r.found, r.frames, r.reprojection_px,
                    r.scale_sigma, r.inflation);
  };
  EXPECT_TRUE(figures(after) == figures(before));
  EXPECT_EQ(format_calibration(after), format_calibration(before));
}

/// A part of the good file, what stands there instead, and how the message begins and what it
/// says.
struct Fault {
  std::string part, instead;
  const char *beginning, *mentions = "";
};

const std::string kSize = "size: [1024, 768]", kLens = "[982, 983, 510, 380]",
                  kDistortion = "[-0.28, 0.07, 1e-4, 2e-5, 0.01]", kPlace = "    T_camera_left",
                  kOfSize = "c.yaml:4: cameras.0.size", kOfLens = "c.yaml:8: cameras.1.intrinsics",
                  kOfDistortion = "c.yaml:9: cameras.1.distortion",
                  kOfPlace = "c.yaml:10: cameras.1.T_camera_left";

TEST(CalibrationPlausibility, impossibleValuesAreRefusedWithPlace) {
  const char *size = kOfSize.c_str(), *lens = kOfLens.c_str(), *distortion = kOfDistortion.c_str(),
             *place = kOfPlace.c_str(), *baseline = "c.yaml:2: rig.baseline";
  const std::string t = "-0.75, 0, 1, 0, 0.01", lengths = "baseline: 0.750702";
  for (const Fault& f : std::vector<Fault>{
           {kSize, "size: [1024, 0]", size, "1024 x 0"},
           {kSize, "size: [-5, 768]", size},
           {kSize, "size: [1024, 768, 1]", size, "[width, height]"},
           {kSize, "size: [1024, 76800]", size},
           {kSize, "size: [1e3, 768]", size, "not an integer"},
           {kLens, "[-982, 983, 510, 380]", lens, "positive"},
           {kLens, "[982, 9830, 510, 380]", lens, "9830"},
           {kLens, "[0.98, 0.98, 510, 380]", lens, "0.98"},
           {kLens, "[982, 2000, 510, 380]", lens, "different"},
           {kLens, "[982, 983, 510]", lens, "3 numbers"},
           {kLens, "[982, 983, 1024, 380]", lens, "outside the image"},
           {kLens, "[982, 983, 510, -1]", lens, "outside the image"},
           {kLens, "[.nan, 983, 510, 380]", lens, "finite"},
           {kLens, "[nan, 983, 510, 380]", lens, "finite"},
           {kLens, "[1e999, 983, 510, 380]", lens},
           {kDistortion, "[-28, 0.07, 1e-4, 2e-5, 0.01]", distortion, "corner"},
           {kDistortion, "[-0.28, 0.07, 2, 2e-5, 0.01]", distortion, "corner"},
           {kDistortion, "[-0.28]", distortion, "4 to 5"},
           {"model: pinhole-radtan\n", "model: pinhole-equidistant\n", distortion, "5 numbers"},
           {kPlace, "    distortion_sigma: [1e-3]\n" + kPlace,
            "c.yaml:10: cameras.1.distortion_sigma has 1 numbers", "4 to 5"},
           {kPlace, "    distortion_sigma: [1e-3, -1e-3, 0, 0]\n" + kPlace,
            "c.yaml:10: cameras.1.distortion_sigma", "negative"},
           {lengths + ", baseline_sigma: 0.0005", "baseline: 0.54", baseline, "0.54 m"},
           {lengths, "baseline: 750.702", baseline, "750.702 m"},
           {lengths, "baseline: 0", baseline, "positive"},
           {t, "-750, 0, 1, 0, 10", place, "metres"},
           {t + ", 0, 0, 1, 0.02", "0, 0, 1, 0, 0, 0, 0, 1, 0", place},
           {t, ".inf, 0, 1, 0, 0.01", place, "finite"},
           {t, "0.75, 0, 1, 0, 0.01", place,
            "left and right are swapped, or the transform is given as its inverse"},
           {kPlace, "    T_camera_lefd", "c.yaml:10: cameras.1 has the unknown key",
            "did you mean \"T_camera_left\"?"},
           {"    sigma_noise", "    size", "c.yaml:11: cameras.1 has the key \"size\" twice"},
           {"    intrinsics: " + kLens + "\n", "", "c.yaml:5: cameras.1.intrinsics is missing"},
           {"version: 1\n", "", "c.yaml:1: version is missing"},
           {"version: 1", "version: 2", "c.yaml:1: version is 2", "reads version 1"},
           {"model: pinhole-radtan\n", "model: pinhole\n",
            "c.yaml:7: cameras.1.model is \"pinhole\"", "pinhole-radtan"},
           {kGood, "", "c.yaml: is empty"},
           {kGood, "just words", "c.yaml:1: the calibration is not a group"},
           {kGood, "version: 1\ncameras: 3\n", "c.yaml:2: cameras is not a list"},
           {kGood, "version: 1\ncameras: [1, 2]\n", "c.yaml:2: cameras.0 is not a group"},
           {kGood, "version: 1\ncameras: [{}]\n", "c.yaml:2: cameras lists 1", "2 to 4"},
       }) {
    const std::string message = refusal(with(f.part, f.instead));
    EXPECT_TRUE(message.starts_with(f.beginning) && test::contains(message, f.mentions))
        << f.instead << " gives: " << message;
  }
  for (const char* four_or_five : {"[1e-3, 1e-3, 1e-4, 1e-4]", "[1e-3, 1e-3, 1e-4, 1e-4, 1e-2]"})
    EXPECT_EQ(
        refusal(with(kPlace, std::string("    distortion_sigma: ") + four_or_five + "\n" + kPlace)),
        "");
  EXPECT_EQ(refusal(with(t, "0.001, 0, 1, 0, -0.75")), "") << "one camera above the other";
}

constexpr const char* kNewRig =
    "version: 1\nrig: {baseline: 0.5}\ncameras:\n"
    "  - {size: [640, 480], model: pinhole-radtan, intrinsics: [450, 450, 320, 240]}\n"
    "  - {size: [640, 480], model: pinhole-radtan, intrinsics: [450, 450, 320, 240]}\n";

TEST(CalibrationFile, fromScratchIntrinsicsAndALengthAreEnough) {
  EXPECT_THROW((void)parse_calibration(kNewRig, "c.yaml"), InputError)
      << "without --from-scratch the places are needed";
  const RigCalibration rig = parse_calibration(kNewRig, "c.yaml", {.length_only = true}).rig;
  EXPECT_EQ(rig.baseline, 0.5);
  EXPECT_EQ(rig.T_camera_left[1].t, Vec3(-0.5, 0, 0));
  EXPECT_EQ(parse_calibration(kNewRig, "c.yaml", {.length_only = true, .baseline = 0.6})
                .rig.T_camera_left[1]
                .t,
            Vec3(-0.6, 0, 0));
}

TEST(CalibrationFile, scratchReadsOnlyLengthOfOldTransform) {
  // Turned by a right angle about z and 0.5 m long: no rig that would be taken as it is.
  const std::string old =
      std::string(kNewRig).replace(std::string(kNewRig).rfind('}'), 1,
                                   ", T_camera_left: [0, -1, 0, 0.3, 1, 0, 0, 0.4, 0, 0, 1, 0], "
                                   "sigma_total: [1, 1, 1, 1, 1, 1]}");
  const RigCalibration rig = parse_calibration(old, "c.yaml", {.length_only = true}).rig;
  EXPECT_EQ(rig.T_camera_left[1].R, Mat3(Mat3::Identity()));
  EXPECT_EQ(rig.T_camera_left[1].t, Vec3(-0.5, 0, 0));
  EXPECT_EQ(rig.sigma_total[1][0], 0);
  std::string no_length = kNewRig;
  no_length.replace(no_length.find("rig: {baseline: 0.5}\n"), 21, "");
  EXPECT_THROW((void)parse_calibration(no_length, "c.yaml", {.length_only = true}), InputError);
}

TEST(CalibrationFile, aGivenBaselineScalesEveryLengthByOneFactor) {
  CalibrationFile file = awkward();
  const RigCalibration before = file.rig;
  RigCalibration rig = before;
  apply_use({.baseline = 2 * before.T_camera_left[1].t.norm()}, &rig);
  EXPECT_EQ(rig.baseline, 2 * before.T_camera_left[1].t.norm());
  for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k) {
    EXPECT_TRUE(rig.T_camera_left[k].t.isApprox(2 * before.T_camera_left[k].t, 1e-15));
    EXPECT_EQ(rig.T_camera_left[k].R, before.T_camera_left[k].R);
    EXPECT_EQ(rig.sigma_total[k][2], before.sigma_total[k][2]);
    EXPECT_EQ(rig.sigma_total[k][4], 2 * before.sigma_total[k][4]);
    EXPECT_EQ(rig.covariance_total[k](0, 0), before.covariance_total[k](0, 0));
    EXPECT_EQ(rig.covariance_total[k](1, 4), 2 * before.covariance_total[k](1, 4));
    EXPECT_EQ(rig.covariance_total[k](3, 5), 4 * before.covariance_total[k](3, 5));
  }
}

const std::string kRig = R"(version: 1
rig: {name: demo, baseline: 0.75}
cameras:
  - {name: left, size: [1024, 768], model: pinhole-radtan, intrinsics: [980, 981, 512, 384]}
  - {name: right, size: [1024, 768], model: pinhole-equidistant, intrinsics: [982, 983, 510, 380], T_camera_left: [1, 0, 0, -0.75, 0, 1, 0, 0, 0, 0, 1, 0]}
)";

std::string with_block(const std::string& parameters, const std::string& upper) {
  return kRig + "covariance:\n  parameters: " + parameters + "\n  upper: " + upper + "\n";
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
           {with_block("[right.rx, right.rx]", "[1, 0, 1]"),
            "c.yaml:7: covariance.parameters has right.rx twice"},
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
