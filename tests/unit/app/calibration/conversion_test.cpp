#include "app/calibration/conversion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>
#include <opencv2/calib3d.hpp>

#include "app/runtime/errors.hpp"
#include "core/camera/camera.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

namespace vergence::app {
namespace {

constexpr double kSamePixel = 1e-9;

/// What a format's file says, in OpenCV's terms: X_camera = R X_left + t.
struct Reference {
  cv::Mat K, D, R, t;
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
  CalibrationFile c;
  c.rig = test::known_rig(cameras, kind);
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

// ---- Kalibr

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

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

const std::string kCamchain = R"(cam0:
  T_cam_imu:
  - [0.0148, -0.9998, 0.0041, -0.0216]
  - [0.9995, 0.0149, 0.0257, -0.0646]
  - [-0.0257, 0.0037, 0.9996, 0.0098]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /left/image_raw
  timeshift_cam_imu: -8.1e-05
cam1:
  T_cn_cnm1:
  - [0.9999972564, 0.0023173770, 0.0003439280, -0.1100738084]
  - [-0.0023123537, 0.9998980481, -0.0140903132, 0.0003991215]
  - [-0.0003765449, 0.0140894793, 0.9999006674, -0.0008537025]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
)";

TEST(Kalibr, aCamchainIsReadAsItsOwnDefinitionProjects) {
  Remarks remarks;
  const CalibrationFile c = read_kalibr(YamlFile::parse(kCamchain, "camchain.yaml"), &remarks);
  expect_same(c, reference_of_camchain(kCamchain));
  EXPECT_EQ(c.names[0], "left");
  EXPECT_EQ(c.names[1], "cam1");
  EXPECT_EQ(c.rig.intrinsics[1].width, 752);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].find("T_cam_imu"), std::string::npos);
}

TEST(Kalibr, aNameIsWhatStandsBeforeTheImageInATopic) {
  const auto names = [](const std::string& left, const std::string& right) {
    const std::string chain =
        replaced(replaced(kCamchain, "/left/image_raw", left), "/cam1/image_raw", right);
    Remarks remarks;
    const auto all = read_kalibr(YamlFile::parse(chain, "camchain.yaml"), &remarks).names;
    return all[0] + " " + all[1];
  };
  EXPECT_EQ(names("/stereo/left/image_raw", "/stereo/right/image_raw"), "left right");
  EXPECT_EQ(names("/rig/port/image_rect_raw/compressed", "starboard/image"), "port starboard");
  EXPECT_EQ(names("/cam_a", "/rig/cam_b"), "cam_a cam_b");
  EXPECT_EQ(names("/image_raw", "//"), "left right") << "names of their own, as without a topic";
}

TEST(Kalibr, whatIsWrittenProjectsAsOursAndReadsBack) {
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind, 3);
    Remarks remarks;
    const std::string text = format_kalibr(c, &remarks);
    expect_same(c, reference_of_camchain(text));
    const CalibrationFile back = read_kalibr(YamlFile::parse(text, "camchain.yaml"), &remarks);
    expect_same(c, back);
    EXPECT_EQ(back.names[2], "bow");
    ASSERT_EQ(remarks.size(), 1U);
    EXPECT_NE(remarks[0].find("serials"), std::string::npos) << remarks[0];
  }
}

TEST(Conversion, WhatIsKnownOfSigmasIsSaidToBeLeftOut) {
  CalibrationFile c = ours(CameraModelKind::pinhole_radtan);
  c.rig.intrinsics[1].distortion_sigma[0] = 1e-3;
  c.rig.covariance.set(intrinsic_row(1) + 4, intrinsic_row(1) + 4, 1e-6);
  Remarks kalibr, ros;
  (void)format_kalibr(c, &kalibr);
  (void)format_ros(c, &ros);
  for (const Remarks& remarks : {kalibr, ros}) {
    ASSERT_FALSE(remarks.empty());
    EXPECT_NE(remarks[0].find("sigmas, the covariance"), std::string::npos) << remarks[0];
  }
}

TEST(Kalibr, aThirdCoefficientOfRadiusHasNoPlaceAndIsNotDropped) {
  CalibrationFile c = ours(CameraModelKind::pinhole_radtan);
  c.rig.intrinsics[0].distortion[4] = 0.01;
  Remarks remarks;
  EXPECT_THROW((void)format_kalibr(c, &remarks), InputError);
}

// ---- ROS

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
    const cv::Mat X_right =
        r.R.t() * r.P.colRange(0, 3).inv() * pixel;  // homogeneous pixel keeps its depth
    const Reference in_left{l.K, l.D, cv::Mat::eye(3, 3, CV_64F), cv::Mat::zeros(3, 1, CV_64F),
                            l.fisheye};
    const Reference in_right{r.K, r.D, cv::Mat::eye(3, 3, CV_64F), cv::Mat::zeros(3, 1, CV_64F),
                             r.fisheye};
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

TEST(RosCameraInfo, whatIsWrittenProjectsAsOursAndReadsBack) {
  for (const auto kind : kModels) {
    CalibrationFile c = ours(kind);
    if (kind == CameraModelKind::pinhole_radtan)
      c.rig.intrinsics[0].distortion[4] = -0.004;  // k3 has its place here
    Remarks remarks;
    const auto [left, right] = format_ros(c, &remarks);
    expect_camera_info(c, info_of(left), info_of(right));
    EXPECT_LT(info_of(right).P.at<double>(0, 3), 0) << "−fx B of a camera on the right";
    const CalibrationFile back = read_ros(YamlFile::parse(left, "left.yaml"),
                                          YamlFile::parse(right, "right.yaml"), &remarks);
    expect_same(c, back);
    EXPECT_EQ(back.names[0], "port");
  }
}

TEST(RosCameraInfo, aPairFromOpenCvsOwnRectificationIsReadAsItProjects) {
  const CalibrationFile truth = ours(CameraModelKind::pinhole_radtan);
  std::array<std::string, 2> text;
  std::array<cv::Mat, 2> K, D;
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = truth.rig.intrinsics[k];
    K[k] = diagonal(lens.fx, lens.fy, lens.cx, lens.cy);
    D[k] = (cv::Mat_<double>(1, 5) << lens.distortion[0], lens.distortion[1], lens.distortion[2],
            lens.distortion[3], 0);
  }
  const Transform& T = truth.rig.T_camera_left[1];
  cv::Mat R(3, 3, CV_64F), t = (cv::Mat_<double>(3, 1) << T.t.x(), T.t.y(), T.t.z()), R1, R2, P1,
                           P2, Q;
  for (int i = 0; i < 9; ++i) R.at<double>(i / 3, i % 3) = T.R(i / 3, i % 3);
  cv::stereoRectify(K[0], D[0], K[1], D[1], {640, 480}, R, t, R1, R2, P1, P2, Q, 0, 1, {640, 480});
  const auto list = [](const cv::Mat& m) {
    return fmt::format("[{}]", fmt::join(m.begin<double>(), m.end<double>(), ", "));
  };
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string d =
        k == 0 ? "plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: " + list(D[k]) + "}"
               : "rational_polynomial\ndistortion_coefficients: {rows: 1, cols: 8, data: [" +
                     fmt::format("{}, 0, 0, 0]}}",
                                 fmt::join(D[k].begin<double>(), D[k].end<double>(), ", "));
    text[k] =
        "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo\ncamera_matrix: {rows: 3, "
        "cols: 3, data: " +
        list(K[k]) + "}\ndistortion_model: " + d +
        "\nrectification_matrix: {rows: 3, cols: 3, data: " + list(k == 0 ? R1 : R2) +
        "}\nprojection_matrix: {rows: 3, cols: 4, data: " + list(k == 0 ? P1 : P2) + "}\n";
  }
  Remarks remarks;
  const CalibrationFile c =
      read_ros(YamlFile::parse(text[0], "l.yaml"), YamlFile::parse(text[1], "r.yaml"), &remarks);
  expect_same(truth, c);
}

// ---- OpenCV

TEST(OpenCvStereo, whatIsWrittenIsReadByOpenCvAndProjectsAsOurs) {
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind);
    Remarks remarks;
    const auto parts = format_opencv(c, &remarks);
    const std::string text = "%YAML:1.0\n---\n" + parts[0] + parts[1];
    cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    Reference left{{},
                   {},
                   cv::Mat::eye(3, 3, CV_64F),
                   cv::Mat::zeros(3, 1, CV_64F),
                   kind == CameraModelKind::pinhole_equidistant};
    Reference right;
    right.fisheye = left.fisheye;
    file["M1"] >> left.K, file["D1"] >> left.D, file["M2"] >> right.K, file["D2"] >> right.D,
        file["R"] >> right.R, file["T"] >> right.t;
    expect_same(c, {left, right});
    expect_same(c, read_opencv({parse_opencv_yaml(text, "stereo.yml")}, std::nullopt, &remarks));
  }
}

TEST(OpenCvStereo, whatOpenCvWritesIsReadAsItProjectsUnderEachOfItsNames) {
  const CalibrationFile truth = ours(CameraModelKind::pinhole_radtan);
  struct Names {
    const char *M1, *D1, *M2, *D2, *R, *T;
  };
  for (const Names& n :
       {Names{"M1", "D1", "M2", "D2", "R", "T"}, Names{"K1", "D1", "K2", "D2", "R", "T"},
        Names{"cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "R", "T"}}) {
    std::array<Reference, 2> references;
    for (std::size_t k = 0; k < 2; ++k) {
      const Intrinsics& lens = truth.rig.intrinsics[k];
      references[k].K = diagonal(lens.fx, lens.fy, lens.cx, lens.cy);
      references[k].D = cv::Mat::zeros(1, 14, CV_64F);
      for (int i = 0; i < 5; ++i)
        references[k].D.at<double>(i) = lens.distortion[static_cast<std::size_t>(i)];
      const Transform& T = truth.rig.T_camera_left[k];
      references[k].t = (cv::Mat_<double>(3, 1) << T.t.x(), T.t.y(), T.t.z());
      references[k].R = cv::Mat(3, 3, CV_64F);
      for (int i = 0; i < 9; ++i) references[k].R.at<double>(i / 3, i % 3) = T.R(i / 3, i % 3);
    }
    // As the sample does: lenses in one file, places in another.
    cv::FileStorage lenses("a.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY),
        places("b.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    lenses << n.M1 << references[0].K << n.D1 << references[0].D << n.M2 << references[1].K << n.D2
           << references[1].D;
    places << n.R << references[1].R << n.T << references[1].t;
    const std::vector<YamlFile> files{
        parse_opencv_yaml(lenses.releaseAndGetString(), "intrinsics.yml"),
        parse_opencv_yaml(places.releaseAndGetString(), "extrinsics.yml")};
    Remarks remarks;
    EXPECT_THROW((void)read_opencv(files, std::nullopt, &remarks), InputError) << "no size";
    expect_same(read_opencv(files, ImageSize{640, 480}, &remarks), {references[0], references[1]});
  }
}

/// As cv::fisheye::stereoCalibrate's answer is written: nothing but the count tells its D from that
/// of a lens with k1 k2 p1 p2, which is legal, too.
TEST(OpenCvStereo, fourCoefficientsThatMayBeOfAFisheyeLensAreSaid) {
  const std::string lens =
      "!!opencv-matrix {rows: 3, cols: 3, dt: d, data: [290, 0, 320, 0, 291, "
      "240, 0, 0, 1]}\n";
  const auto text = [&](const std::string& d, const std::string& more) {
    return "%YAML:1.0\n---\nM1: " + lens + "D1: " + d + "M2: " + lens + "D2: " + d +
           "R: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
           "T: {rows: 3, cols: 1, data: [-0.12, 0, 0]}\nimageSize: [640, 480]\n" +
           more;
  };
  const std::string four = "{rows: 4, cols: 1, data: [-0.02, 0.008, -0.004, 0.0008]}\n",
                    five = "{rows: 1, cols: 5, data: [-0.02, 0.008, -0.004, 0.0008, 0]}\n";
  const auto read = [](const std::string& yaml, Remarks* remarks) {
    return read_opencv({parse_opencv_yaml(yaml, "stereo.yml")}, std::nullopt, remarks)
        .rig.intrinsics[1]
        .kind;
  };
  Remarks remarks;
  EXPECT_EQ(read(text(four, ""), &remarks), CameraModelKind::pinhole_radtan);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].find("stereo.yml: four distortion coefficients"), std::string::npos);
  EXPECT_NE(remarks[0].find("fisheye_model: 1"), std::string::npos) << remarks[0];

  remarks.clear();
  EXPECT_EQ(read(text(four, "fisheye_model: 1\n"), &remarks), CameraModelKind::pinhole_equidistant);
  EXPECT_EQ(read(text(four, "fisheye_model: 0\n"), &remarks), CameraModelKind::pinhole_radtan);
  EXPECT_EQ(read(text(five, ""), &remarks), CameraModelKind::pinhole_radtan);
  EXPECT_TRUE(remarks.empty()) << remarks[0];
}

// ---- all of them

TEST(Conversion, everyFormatToEveryOtherAndBackIsTheSameRig) {
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
      write_any_calibration(in, first, c, &remarks);
      EXPECT_EQ(format_of_name(in), first);
      for (const auto& [second, out] : kOuts) {
        if (first == second) continue;
        (void)convert_calibration({in, out, std::nullopt, std::nullopt});
        expect_same(c, read_any_calibration(out, std::nullopt, &remarks));
      }
    }
  }
  // Two files with a comma.
  Remarks remarks;
  const std::string pair = (folder / "a.yaml").string() + "," + (folder / "b.yaml").string();
  write_any_calibration(pair, CalibrationFormat::ros, ours(kModels[0]), &remarks);
  expect_same(ours(kModels[0]), read_any_calibration(pair, std::nullopt, &remarks));
}

TEST(Conversion, namesAndSerialsSurviveWhereTheyHaveAPlace) {
  const test::TemporaryFolder folder;
  const CalibrationFile c = ours(kModels[0]);
  Remarks remarks;
  write_any_calibration((folder / "c.yaml").string(), CalibrationFormat::vergence, c, &remarks);
  EXPECT_TRUE(remarks.empty());
  const CalibrationFile same =
      read_any_calibration((folder / "c.yaml").string(), std::nullopt, &remarks);
  EXPECT_EQ(same.serials[0], "4711");
  write_any_calibration((folder / "camchain.yaml").string(), CalibrationFormat::kalibr, c,
                        &remarks);
  EXPECT_EQ(
      read_any_calibration((folder / "camchain.yaml").string(), std::nullopt, &remarks).names[1],
      "starboard");
  ASSERT_FALSE(remarks.empty());
}

/// One sentence that names the file and the key.
std::string last_error(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Conversion, spoiltFilesAreRefusedWithFileAndKey) {
  Remarks none;
  const auto [left, right] = format_ros(ours(kModels[0]), &none);
  const auto parts = format_opencv(ours(kModels[0]), &none);
  const std::string opencv = "%YAML:1.0\n---\n" + parts[0] + parts[1];
  struct Case {
    std::string text, second, key;
  };
  const std::vector<Case> cases{
      {"", "", "is empty"},
      {"just words", "", "is not a group of keys"},
      {"a: [1, 2", "", "is not YAML"},
      {"a: 1", "", "is no calibration that this program knows"},
      {replaced(kCamchain, "camera_model: pinhole", "camera_model: omni"), "",
       "cam0.camera_model is \"omni\""},
      {replaced(kCamchain, "distortion_model: radtan", "distortion_model: fov"), "",
       "cam0.distortion_model is \"fov\""},
      {replaced(kCamchain, "[458.654, 457.296, 367.215, 248.375]",
                "[458.654, .nan, 367.215, 248.375]"),
       "", "cam0.intrinsics"},
      {replaced(kCamchain, "[458.654, 457.296, 367.215, 248.375]",
                "[458.654, 1e308, 367.215, 248.375]"),
       "", "cameras.0.intrinsics"},
      {replaced(kCamchain, "[458.654, 457.296, 367.215, 248.375]", "[458.654, 457.296]"), "",
       "cam0.intrinsics has 2 numbers"},
      {replaced(kCamchain, "[752, 480]", "[752]"), "", "cam0.resolution"},
      {replaced(kCamchain, "[752, 480]", "[99999999999, 480]"), "", "cam0.resolution"},
      {replaced(kCamchain, "  T_cn_cnm1:", "  T_c1_c0:"), "", "cam1.T_cn_cnm1 is missing"},
      {replaced(kCamchain, "[0.9999972564,", "[0.5,"), "", "not orthonormal"},
      {replaced(kCamchain, "-0.1100738084", "-110.0738084"), "", "m from the left one"},
      {"cam0: {camera_model: pinhole}", "", "cam0.resolution is missing"},
      {"cam0: 7", "", "cam0 is not a group of keys"},
      {left, "", "makes no rig"},
      {left, replaced(right, "image_width: 640", "image_width: many"), "image_width is \"many\""},
      {left, replaced(right, "camera_matrix:", "camera:"), "camera_matrix is missing"},
      {left, replaced(right, "rows: 3", "rows: 4"), "camera_matrix.data is not a list"},
      {left, replaced(right, "plumb_bob", "thin_prism"), "distortion_model is \"thin_prism\""},
      {left, left, "has no baseline"},
      {replaced(opencv, "M2:", "X2:"), "", "a camera matrix is missing (M2 or K2)"},
      {replaced(opencv, "T:", "X:"), "", "the translation of camera 2 from camera 1 is missing"},
      {replaced(opencv, "image_width: 640\n", ""), "", "--size"},
      {replaced(opencv, "fisheye_model: 0", "fisheye_model: 7"), "", "fisheye_model is 7"},
  };
  const test::TemporaryFolder folder;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    std::string in = folder.write("in.yaml", cases[i].text).string();
    if (!cases[i].second.empty()) in += "," + folder.write("second.yaml", cases[i].second).string();
    const std::string said =
        last_error([&] { (void)read_any_calibration(in, std::nullopt, &none); });
    EXPECT_NE(said.find(cases[i].key), std::string::npos) << "case " << i << " said: " << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    EXPECT_NE(said.find(folder.path().string()), std::string::npos) << "which file: " << said;
  }
  EXPECT_THROW((void)read_any_calibration((folder / "none").string(), std::nullopt, &none),
               InputError);
}

TEST(Conversion, rationalLensesAreRefusedUnlessTheyAreNone) {
  Remarks none;
  const auto parts = format_opencv(ours(kModels[0]), &none);
  const std::string more =
      replaced(replaced(parts[0], "cols: 5", "cols: 8"), "-0.0005, 0]", "-0.0005, 0, 0, 0, 0.02]") +
      parts[1];
  const std::string said = last_error(
      [&] { (void)read_opencv({parse_opencv_yaml(more, "m.yml")}, std::nullopt, &none); });
  EXPECT_NE(said.find("D1 has a sixth or later coefficient"), std::string::npos) << said;
}

TEST(Conversion, aFileWithSomeBytesChangedIsReadOrRefusedAndNothingElse) {
  Remarks none;
  const auto [left, right] = format_ros(ours(kModels[0]), &none);
  const auto parts = format_opencv(ours(kModels[1]), &none);
  const test::TemporaryFolder folder;
  const std::string second = folder.write("right.yaml", right).string();
  Random random(77);
  int refused = 0;
  for (int run = 0; run < 300; ++run) {
    std::string text = run % 3 == 0   ? kCamchain
                       : run % 3 == 1 ? left
                                      : "%YAML:1.0\n---\n" + parts[0] + parts[1];
    for (int i = 0; i < 4; ++i)
      text[random.below(static_cast<std::uint32_t>(text.size()))] =
          static_cast<char>(random.below(256));
    if (run % 5 == 0) text.resize(random.below(static_cast<std::uint32_t>(text.size())));
    std::string in = folder.write("in.yaml", text).string();
    if (run % 3 == 1) in += "," + second;
    if (!last_error([&] { (void)read_any_calibration(in, std::nullopt, &none); }).empty())
      ++refused;
  }
  EXPECT_GT(refused, 100);
}

TEST(Conversion, wordsOfTheCommandLineAreChecked) {
  EXPECT_EQ(parse_format("ros"), CalibrationFormat::ros);
  EXPECT_NE(last_error([] { (void)parse_format("kalbr"); }).find("did you mean \"kalibr\""),
            std::string::npos);
  EXPECT_EQ(parse_size("640x480"), (ImageSize{640, 480}));
  for (const char* bad : {"", "640", "640x", "x480", "640x-1", "640x480x3", "640*480"})
    EXPECT_THROW((void)parse_size(bad), InputError) << bad;
  EXPECT_THROW((void)format_of_name("calibration.txt"), InputError);
  EXPECT_EQ(format_of_name("intrinsics.yml,extrinsics.yml"), CalibrationFormat::opencv);
  EXPECT_EQ(format_of_name("l.yaml,r.yaml"), CalibrationFormat::ros);
}

}  // namespace
}  // namespace vergence::app
