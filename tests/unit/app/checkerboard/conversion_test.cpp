#include "app/checkerboard/conversion.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>
#include <opencv2/calib3d.hpp>

#include "app/runtime/durable_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"

namespace vergence::app {
namespace {

constexpr double kSamePixel = 1e-9;

/// Content of a format's file in OpenCV's terms: X_camera = R X_left + t.
struct Reference {
  cv::Mat K{}, D{}, R = cv::Mat::eye(3, 3, CV_64F), t = cv::Mat::zeros(3, 1, CV_64F);
  bool fisheye = false;
};

Vec2 project(const Reference& r, const Vec3& X_left) {
  const cv::Mat in_camera =
      r.R * (cv::Mat_<double>(3, 1) << X_left.x(), X_left.y(), X_left.z()) + r.t;
  const std::vector<cv::Point3d> X{
      {in_camera.at<double>(0), in_camera.at<double>(1), in_camera.at<double>(2)}};
  const cv::Mat none = cv::Mat::zeros(3, 1, CV_64F);
  std::vector<cv::Point2d> x;
  if (r.fisheye)
    cv::fisheye::projectPoints(X, x, none, none, r.K, r.D);
  else
    cv::projectPoints(X, none, none, r.K, r.D, x);
  return {x[0].x, x[0].y};
}

std::vector<Vec3> points() {
  Random random(31);
  std::vector<Vec3> points;
  for (int i = 0; i < 200; ++i) {
    const double z = random.uniform(0.5, 20);
    points.emplace_back(z * random.uniform(-0.45, 0.45), z * random.uniform(-0.35, 0.35), z);
  }
  return points;
}

/// Both project every point to the same pixel in every camera.
void expect_same(const CalibrationFile& ours, const std::vector<Reference>& theirs) {
  ASSERT_EQ(static_cast<std::size_t>(ours.rig.cameras), theirs.size());
  for (std::size_t k = 0; k < theirs.size(); ++k) {
    const Camera camera(ours.rig.intrinsics[k]);
    double worst = 0;
    for (const Vec3& X : points()) {
      Vec2 x;
      ASSERT_EQ(camera.project(ours.rig.T_camera_left[k] * X, &x, nullptr), ProjectStatus::ok);
      worst = std::max(worst, (x - project(theirs[k], X)).norm());
    }
    EXPECT_LT(worst, kSamePixel) << "camera " << k;
  }
}

void expect_same(const CalibrationFile& a, const CalibrationFile& b) {
  ASSERT_EQ(a.rig.cameras, b.rig.cameras);
  for (std::size_t k = 0; k < static_cast<std::size_t>(a.rig.cameras); ++k) {
    EXPECT_EQ(a.rig.intrinsics[k].width, b.rig.intrinsics[k].width);
    EXPECT_EQ(a.rig.intrinsics[k].height, b.rig.intrinsics[k].height);
    EXPECT_EQ(a.rig.intrinsics[k].kind, b.rig.intrinsics[k].kind);
    const Camera one(a.rig.intrinsics[k]), other(b.rig.intrinsics[k]);
    for (const Vec3& X : points()) {
      Vec2 x, y;
      ASSERT_EQ(one.project(a.rig.T_camera_left[k] * X, &x, nullptr), ProjectStatus::ok);
      ASSERT_EQ(other.project(b.rig.T_camera_left[k] * X, &y, nullptr), ProjectStatus::ok);
      ASSERT_LT((x - y).norm(), kSamePixel) << "camera " << k;
    }
  }
}

CalibrationFile ours(CameraModelKind kind, int cameras = 2) {
  CalibrationFile c{.rig = test::known_rig(cameras, kind)};
  for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k)
    c.rig.T_camera_left[k].R =
        normalised(exp_so3(Vec3(0.02, -0.05, 0.013)) * c.rig.T_camera_left[k].R);
  c.names = {"port", "starboard", "bow", "stern"};
  c.serials[0] = "4711";
  return c;
}

constexpr std::array kModels{CameraModelKind::pinhole_radtan, CameraModelKind::pinhole_equidistant};

cv::Mat diagonal(double fx, double fy, double cx, double cy) {
  return (cv::Mat_<double>(3, 3) << fx, 0, cx, 0, fy, cy, 0, 0, 1);
}

cv::Mat matrix(const YAML::Node& list, int rows, int columns) {
  cv::Mat m(rows, columns, CV_64F);
  for (int i = 0; i < rows * columns; ++i)
    m.at<double>(i / columns, i % columns) = list[static_cast<std::size_t>(i)].as<double>();
  return m;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

void write_as(CalibrationFormat format, const std::filesystem::path& out,
              const CalibrationFile& calibration) {
  Remarks remarks;
  for (const auto& [file, text] : format_calibration_as(format, out, calibration, &remarks)) {
    std::filesystem::create_directories(file.parent_path());
    replace_durably(file, text);
  }
}

std::string opencv_file(const CalibrationFile& calibration, Remarks* remarks) {
  const auto [lenses, place] = format_opencv(calibration, remarks);
  return "%YAML:1.0\n---\n" + lenses + place;
}

TEST(Conversion, roundTripKeepsTheRig) {
  const test::TemporaryFolder folder;
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind);
    const std::array<std::pair<CalibrationFormat, std::string>, 4> kOuts{
        {{CalibrationFormat::vergence, (folder / "c.yaml").string()},
         {CalibrationFormat::kalibr, (folder / "camchain.yaml").string()},
         {CalibrationFormat::ros, (folder / "ros").string() + "/"},
         {CalibrationFormat::opencv, (folder / "stereo.yml").string()}}};
    for (const auto& [first, in] : kOuts) {
      Remarks remarks;
      write_as(first, in, c);
      EXPECT_EQ(format_of("", in), first);
      for (const auto& [second, out] : kOuts) {
        if (first == second) continue;
        (void)convert_calibration({in, out, second, std::nullopt, true});
        expect_same(c, read_any_calibration(out, std::nullopt, &remarks));
      }
    }
  }
  // Two files with a comma.
  for (const auto& [format, ending] :
       {std::pair(CalibrationFormat::ros, ".yaml"), std::pair(CalibrationFormat::opencv, ".yml")}) {
    Remarks remarks;
    const std::string first = (folder / "a").string(), second = (folder / "b").string(),
                      pair = first + ending + "," + second + ending;
    write_as(format, pair, ours(kModels[0]));
    expect_same(ours(kModels[0]), read_any_calibration(pair, std::nullopt, &remarks));
    EXPECT_THROW(write_as(CalibrationFormat::kalibr, pair, ours(kModels[0])), InputError);
  }
}

TEST(Conversion, corruptFilesNameFileAndKey) {
  Remarks none;
  const std::string kalibr = format_kalibr(ours(kModels[0]), &none);
  const auto [left, right] = format_ros(ours(kModels[0]), &none);
  const std::string opencv = opencv_file(ours(kModels[0]), &none);
  const char* kLens = "[520, 521, 322, 238]";
  struct Case {
    std::string text, second, key;
  };
  const std::vector<Case> cases{
      {"", "", "is empty"},
      {"just words", "", "is not a calibration"},
      {"a: [1, 2", "", "is not YAML"},
      {"a: 1", "", "the camera matrix of a second camera is missing"},
      {replaced(kalibr, "camera_model: pinhole", "camera_model: omni"), "",
       "cam0.camera_model is \"omni\""},
      {replaced(kalibr, "distortion_model: radtan", "distortion_model: fov"), "",
       "cam0.distortion_model is \"fov\""},
      {replaced(kalibr, kLens, "[520, .nan, 322, 238]"), "", "cam0.intrinsics"},
      {replaced(kalibr, kLens, "[520, 1e308, 322, 238]"), "", "cameras.0.intrinsics"},
      {replaced(kalibr, kLens, "[520, 521]"), "", "cam0.intrinsics is neither"},
      {replaced(kalibr, "[640, 480]", "[640]"), "", "cam0.resolution"},
      {replaced(kalibr, "[640, 480]", "[99999999999, 480]"), "", "cam0.resolution"},
      {replaced(kalibr, "  T_cn_cnm1:", "  T_unknown:"), "", "T_cn_cnm1 of cam1"},
      {replaced(kalibr, "T_cn_cnm1:\n  - [", "T_cn_cnm1:\n  - [5"), "", "not orthonormal"},
      {replaced(kalibr, ", -0.12]", ", -120]"), "", "m from the left one"},
      {"cam0: {camera_model: pinhole}", "", "the camera matrix of a second camera is missing"},
      {"cam0: 7", "", "the camera matrix of a second camera is missing"},
      {left, "", "the camera matrix of a second camera is missing"},
      {left, replaced(right, "image_width: 640", "image_width: many"), "image_width is \"many\""},
      {left, replaced(right, "camera_matrix:", "camera_thing:"),
       "the camera matrix of a second camera is missing"},
      {left, replaced(right, "rows: 3", "rows: 4"), "camera_matrix.data is not a list"},
      {left, replaced(right, "plumb_bob", "thin_prism"), "distortion_model is \"thin_prism\""},
      {left, left, "has no baseline"},
      {replaced(opencv, "M2:", "X2:"), "", "the camera matrix of a second camera is missing"},
      {replaced(opencv, "T:", "X:"), "", "T of camera 2 from camera 1 is missing"},
      {replaced(opencv, "image_width: 640\n", ""), "", "--size"},
      {replaced(opencv, "fisheye_model: 0", "fisheye_model: 7"), "", "fisheye_model is 7"},
      {replaced(replaced(opencv, "cols: 5", "cols: 8"), "-0.0005, 0]", "-0.0005, 0, 0, 0, 0.02]"),
       "", "D1 has k4 to k6"},
  };
  const test::TemporaryFolder folder;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    std::string in = folder.write("in.yaml", cases[i].text).string();
    if (!cases[i].second.empty()) in += "," + folder.write("second.yaml", cases[i].second).string();
    const std::string said =
        test::refusal_of([&] { (void)read_any_calibration(in, std::nullopt, &none); });
    EXPECT_TRUE(test::mentions(said, cases[i].key)) << "case " << i;
    EXPECT_FALSE(test::contains(said, "\n")) << said;
    EXPECT_TRUE(test::mentions(said, folder.path().string())) << "which file";
  }
  EXPECT_THROW((void)read_any_calibration((folder / "none").string(), std::nullopt, &none),
               InputError);
}

TEST(Conversion, parsesFormatSizeAndFileName) {
  EXPECT_EQ(format_of("ros", "a.yaml"), CalibrationFormat::ros);
  EXPECT_EQ(parse_size("640x480"), (ImageSize{640, 480}));
  for (const char* bad : {"", "640", "640x", "x480", "640x-1", "640x480x3", "640*480"})
    EXPECT_THROW((void)parse_size(bad), InputError) << bad;
  EXPECT_THROW((void)format_of("", "calibration.txt"), InputError);
  EXPECT_EQ(format_of("", "intrinsics.yml,extrinsics.yml"), CalibrationFormat::opencv);
  EXPECT_EQ(format_of("", "l.yaml,r.yaml"), CalibrationFormat::ros);
}

/// By Kalibr's own words: X_cn = T_cn_cnm1 X_cn-1, one after the other.
std::vector<Reference> reference_of_camchain(const std::string& text) {
  const YAML::Node root = YAML::Load(text);
  std::vector<Reference> references;
  cv::Mat before = cv::Mat::eye(4, 4, CV_64F);
  for (int k = 0; root[fmt::format("cam{}", k)]; ++k) {
    const YAML::Node cam = root[fmt::format("cam{}", k)];
    if (k > 0) {
      cv::Mat step(4, 4, CV_64F);
      for (int i = 0; i < 16; ++i)
        step.at<double>(i / 4, i % 4) =
            cam["T_cn_cnm1"][static_cast<std::size_t>(i / 4)][static_cast<std::size_t>(i % 4)]
                .as<double>();
      before = step * before;
    }
    const auto f = cam["intrinsics"].as<std::vector<double>>();
    Reference r{diagonal(f[0], f[1], f[2], f[3]), cv::Mat::zeros(4, 1, CV_64F),
                before(cv::Rect(0, 0, 3, 3)).clone(), before(cv::Rect(3, 0, 1, 3)).clone(),
                cam["distortion_model"].as<std::string>() == "equidistant"};
    if (cam["distortion_model"].as<std::string>() != "none")
      r.D = matrix(cam["distortion_coeffs"], 4, 1);
    references.push_back(r);
  }
  return references;
}

TEST(Kalibr, writtenFileProjectsAsReference) {
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind, 3);
    Remarks remarks;
    const std::string text = format_kalibr(c, &remarks);
    expect_same(c, reference_of_camchain(text));
    const CalibrationFile back =
        parse_any_calibration({{"camchain.yaml", text}}, std::nullopt, &remarks);
    expect_same(c, back);
    ASSERT_EQ(remarks.size(), 1U);
    EXPECT_TRUE(test::mentions(remarks[0], "serial"));
  }
}

TEST(Kalibr, k3IsRefused) {
  CalibrationFile c = ours(CameraModelKind::pinhole_radtan);
  c.rig.intrinsics[0].distortion[4] = 0.01;
  Remarks remarks;
  EXPECT_THROW((void)format_kalibr(c, &remarks), InputError);
}

struct Info {
  cv::Mat K, D, R, P;
  bool fisheye = false;
};

Info info_of(const std::string& text) {
  const YAML::Node root = YAML::Load(text);
  const int d = root["distortion_coefficients"]["cols"].as<int>();
  return {matrix(root["camera_matrix"]["data"], 3, 3),
          matrix(root["distortion_coefficients"]["data"], 1, d),
          matrix(root["rectification_matrix"]["data"], 3, 3),
          matrix(root["projection_matrix"]["data"], 3, 4),
          root["distortion_model"].as<std::string>() == "equidistant"};
}

/// By the definition of sensor_msgs/CameraInfo: a point X of the rectified left camera has the
/// pixel P (X, 1) in each rectified image, and lies at R⁻¹ K'⁻¹ (pixel, 1) · depth in the camera
/// itself, where K and D make the raw image of it.
void expect_camera_info(const CalibrationFile& c, const Info& l, const Info& r) {
  for (const Vec3& X_left : points()) {
    const cv::Mat X = (cv::Mat_<double>(3, 1) << X_left.x(), X_left.y(), X_left.z());
    cv::Mat rectified(4, 1, CV_64F, 1.0);
    rectified.rowRange(0, 3) = l.R * X;
    const cv::Mat pixel = r.P * rectified;
    // A homogeneous pixel keeps its depth.
    const cv::Mat X_right = r.R.t() * r.P.colRange(0, 3).inv() * pixel;
    const Reference in_left{.K = l.K, .D = l.D, .fisheye = l.fisheye},
        in_right{.K = r.K, .D = r.D, .fisheye = r.fisheye};
    Vec2 x_left, x_right;
    ASSERT_EQ(Camera(c.rig.intrinsics[0]).project(X_left, &x_left, nullptr), ProjectStatus::ok);
    ASSERT_EQ(
        Camera(c.rig.intrinsics[1]).project(c.rig.T_camera_left[1] * X_left, &x_right, nullptr),
        ProjectStatus::ok);
    ASSERT_LT((x_left - project(in_left, X_left)).norm(), kSamePixel);
    ASSERT_LT((x_right - project(in_right, {X_right.at<double>(0), X_right.at<double>(1),
                                            X_right.at<double>(2)}))
                  .norm(),
              kSamePixel);
    // Rectified rows are the same in both images: what camera_info is for.
    const cv::Mat left_pixel = l.P * rectified;
    ASSERT_NEAR(left_pixel.at<double>(1) / left_pixel.at<double>(2),
                pixel.at<double>(1) / pixel.at<double>(2), 1e-8);
  }
}

TEST(RosCameraInfo, writtenFileProjectsAsReference) {
  for (const auto kind : kModels) {
    CalibrationFile c = ours(kind);
    // This format stores k3.
    if (kind == CameraModelKind::pinhole_radtan) c.rig.intrinsics[0].distortion[4] = -0.004;
    Remarks remarks;
    const auto [left, right] = format_ros(c, &remarks);
    expect_camera_info(c, info_of(left), info_of(right));
    EXPECT_LT(info_of(right).P.at<double>(0, 3), 0) << "−fx B of a camera on the right";
  }
}

TEST(OpenCvStereo, writtenFileIsReadByOpenCv) {
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind);
    Remarks remarks;
    const std::string text = opencv_file(c, &remarks);
    cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    const bool fisheye = kind == CameraModelKind::pinhole_equidistant;
    Reference left{.fisheye = fisheye}, right{.fisheye = fisheye};
    file["M1"] >> left.K, file["D1"] >> left.D, file["M2"] >> right.K, file["D2"] >> right.D,
        file["R"] >> right.R, file["T"] >> right.t;
    expect_same(c, {left, right});
  }
}

/// As cv::fisheye::stereoCalibrate's answer is written: nothing but the count tells its D from that
/// of a lens with k1 k2 p1 p2, which is legal, too.
TEST(OpenCvStereo, fourCoefficientsGiveAWarning) {
  Remarks remarks;
  const std::string five = opencv_file(ours(CameraModelKind::pinhole_radtan), &remarks);
  std::string four = five;
  for (int k = 0; k < 2; ++k)
    four = replaced(replaced(four, "cols: 5", "cols: 4"), "-0.0005, 0]", "-0.0005]");
  const std::string model = "fisheye_model: 0\n";
  struct Case {
    std::string text;
    CameraModelKind kind;
    std::size_t remarks;
  };
  for (const Case& c :
       {Case{replaced(four, model, ""), CameraModelKind::pinhole_radtan, 1},
        Case{replaced(four, model, "fisheye_model: 1\n"), CameraModelKind::pinhole_equidistant, 0},
        Case{four, CameraModelKind::pinhole_radtan, 0},
        Case{replaced(five, model, ""), CameraModelKind::pinhole_radtan, 0}}) {
    remarks.clear();
    const auto read = parse_any_calibration({{"stereo.yml", c.text}}, std::nullopt, &remarks);
    EXPECT_EQ(read.rig.intrinsics[1].kind, c.kind) << c.text;
    ASSERT_EQ(remarks.size(), c.remarks) << c.text;
    for (const std::string& remark : remarks)
      EXPECT_TRUE(test::mentions(remark, "stereo.yml", "fisheye_model: 1"));
  }
}

}  // namespace
}  // namespace vergence::app
