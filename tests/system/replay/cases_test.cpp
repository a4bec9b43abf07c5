// Small copies of inputs that users have: what is read, reported or refused, and why.

#include <functional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/math/random.hpp"
#include "core/math/se3.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/ros_messages.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

/// Times in ns.
constexpr std::int64_t kStart = 1'403'636'584'763'555'584, kStep = 50'000'000;
constexpr int kWidth = 96, kHeight = 72, kFrames = 6;
constexpr double kFocal = 80, kBaseline = 0.11;
/// Stands for an exit code of 0 or 1, as tiny images may have no pose.
constexpr int kRead = -1;

/// One input. `build` writes it and gives the command's words; @ stands for its folder.
struct Case {
  const char* name;
  std::function<std::string(const TemporaryFolder&)> build;
  int code = 0;
  /// Parts of the output, separated by bars.
  std::string mentions{};
  /// Number of frames that a replay reads.
  int frames = kFrames;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

// ---- trajectories

struct Pose {
  std::int64_t ns;
  Vec3 t;
  Eigen::Quaterniond q;
};

/// Along a bend, turning; `noise` m.
std::vector<Pose> poses(double noise) {
  Random random(7);
  std::vector<Pose> all;
  for (int i = 0; i < 60; ++i) {
    const double a = 0.03 * i;
    const Vec3 wobble(random.normal(), random.normal(), random.normal());
    all.push_back(
        {kStart + i * kStep,
         Vec3(5 * std::sin(a), 5 - 5 * std::cos(a), 0.5 * std::sin(2 * a)) + noise * wobble,
         quaternion(exp_so3(Vec3(0.4 * std::sin(a), 0.2, a)))});
  }
  return all;
}

std::string numbers(const Pose& p, const char* between, bool w_first) {
  const auto& q = p.q;
  const std::vector<double> v =
      w_first ? std::vector<double>{p.t.x(), p.t.y(), p.t.z(), q.w(), q.x(), q.y(), q.z()}
              : std::vector<double>{p.t.x(), p.t.y(), p.t.z(), q.x(), q.y(), q.z(), q.w()};
  return fmt::format("{:.7f}", fmt::join(v, between));
}
std::string matrix_of(const Pose& p) {
  Eigen::Matrix<double, 4, 3> columns;
  columns << p.q.toRotationMatrix().transpose(), p.t.transpose();
  return fmt::format("{:.9f}", fmt::join(columns.data(), columns.data() + 12, " "));
}

/// A line of the pattern for every moment: {ns} {us} {ms} {s}: the stamp; {sec} {nsec} {usec}:
/// parts; {i} {f} {t}: number, 0.05 i and 0.05 i + 4.76; {p} {w}: a pose, {w} with w first, {pc}
/// {wc} with commas; {m}: its matrix. What stands before a `|` is for every 20th from the fourth
/// on.
std::string lines(std::string_view pattern, int count, double noise = 0.003) {
  const std::size_t bar = pattern.find('|');
  const std::string_view seldom = pattern.substr(0, bar == std::string_view::npos ? 0 : bar),
                         usual = pattern.substr(bar + 1);
  std::string out;
  const auto all = poses(noise);
  for (int i = 0; i < count; ++i) {
    const Pose& p = all[static_cast<std::size_t>(i)];
    const std::int64_t sec = p.ns / 1'000'000'000, nsec = p.ns % 1'000'000'000;
    using fmt::arg;
    out += fmt::format(fmt::runtime(bar != std::string_view::npos && i % 20 == 3 ? seldom : usual),
                       arg("ns", p.ns), arg("us", p.ns / 1000),
                       arg("ms", static_cast<double>(p.ns) / 1e6),
                       arg("s", fmt::format("{}.{:09d}", sec, nsec)), arg("sec", sec),
                       arg("nsec", nsec), arg("usec", nsec / 1000), arg("i", i), arg("f", 0.05 * i),
                       arg("t", 4.76 + 0.05 * i), arg("p", numbers(p, " ", false)),
                       arg("w", numbers(p, " ", true)), arg("pc", numbers(p, ",", false)),
                       arg("wc", numbers(p, ",", true)), arg("m", matrix_of(p))) +
           "\n";
  }
  return out;
}

constexpr int kPoses = 60;
const std::string kTum = "{s} {p}";

std::vector<Case> trajectories() {
  struct Row {
    const char* name;
    /// Patterns of the two files.
    std::string estimate, reference;
    std::string mentions;
    int code = 0;
    const char* options = "";
  };
  const std::vector<Row> rows{
      {"ns with decimals", "{ns}.000000 {p}", kTum, "nanoseconds|60 poses matched"},
      {"us", "{us} {p}", kTum, "microseconds|59 poses matched"},
      {"ms", "{ms:.3f} {p}", kTum, "milliseconds|poses matched"},
      {"ms since the start", "{i}00 {p}", kTum, "--time-unit", 2},
      {"VINS", "{ns},{wc},", kTum, "w first|60 poses matched"},
      {"VINS as the reference", kTum, "{ns},{wc},", "w first|60 poses matched"},
      {"NaN and double blanks", "{s}  NaN NaN NaN NaN NaN NaN NaN|{s}  {p}", kTum,
       "3 rows with NaN|57 poses matched"},
      {"lost, all zeros", "{s} 0 0 0 0 0 0 0|{s} {p}", kTum, "3 rows|57 poses matched"},
      {"all stamps equal", "1403636584.0 {p}", kTum, "the same stamp in all", 2},
      {"repeated", "{s} {p}\n{s} {p}|{s} {p}", kTum,
       "3 rows that repeat a stamp are dropped|60 poses matched"},
      {"out of order", "{s} {p}\n1403636584.1 {p}|{s} {p}", kTum, "rows are sorted by time"},
      {"KITTI without times", "{m}", "{m}", "row by row|60 poses matched"},
      {"KITTI of fewer poses", "{m}", "{m}\n{m}|{m}", "has 60 poses|has 63", 2},
      {"KITTI of more poses", "{m}\n{m}|{m}", "{m}", "has 63 poses|has 60", 2},
      {"numbers before matrices", "{i} {m}", "{m}", "row by row|60 poses matched"},
      {"w first", "{s} {w}", kTum, "rotations differ|--quaternion wxyz"},
      {"w first, said", "{s} {w}", kTum, "60 poses matched", 0, "--quaternion wxyz"},
      {"reference of 1 Hz", kTum, kTum + "|#", "--max-gap|1 s apart"},
      {"commas and a header", "{ns},{pc}", kTum, "--quaternion xyzw"},
      {"date and time", "2014-06-24 18:29:0{t:.3f} {p}", kTum, "0 poses matched", 1},
      {"seconds and nanoseconds", "{sec} {nsec} {p}", kTum, "60 poses matched"},
  };
  std::vector<Case> all;
  for (const Row& row : rows)
    all.push_back({row.name,
                   [row](const TemporaryFolder& f) {
                     f.write("e.txt", lines(row.estimate, kPoses));
                     f.write("r.txt", lines(row.reference, kPoses, 0));
                     return std::string("evaluate @/e.txt @/r.txt ") + row.options;
                   },
                   row.code, row.mentions});
  return all;
}

// ---- calibrations

const std::string kSize = "image_width: 96\nimage_height: 72\n";
std::string matrix(const std::string& key, int rows, int columns, const std::string& data) {
  return fmt::format("{}: !!opencv-matrix\n  rows: {}\n  cols: {}\n  dt: d\n  data: [{}]\n", key,
                     rows, columns, data);
}
const std::string kK = "80, 0, 48, 0, 80, 36, 0, 0, 1", kD = "-0.1, 0.01, 0, 0",
                  kEye = "1, 0, 0, 0, 1, 0, 0, 0, 1";
std::string opencv(const std::vector<std::string>& keys, const std::string& t = "-0.11, 0, 0",
                   const std::string& r = kEye) {
  return "%YAML:1.0\n---\n" + matrix(keys[0], 3, 3, kK) + matrix(keys[1], 1, 4, kD) +
         matrix(keys[2], 3, 3, kK) + matrix(keys[3], 1, 4, kD) + matrix(keys[4], 3, 3, r) +
         matrix(keys[5], 3, 1, t);
}
const std::vector<std::string> kKeys{"M1", "D1", "M2", "D2", "R", "T"};
/// A pose by its first two rows; its third is that of the identity.
std::string pose(const std::string& key, const std::string& first, const std::string& second) {
  return fmt::format("  {}: [[{}], [{}], [0, 0, 1, 0], [0, 0, 0, 1]]\n", key, first, second);
}
std::string kalibr(const std::string& left = "", const std::string& right = "",
                   const std::string& model = "radtan") {
  const std::string lens = "  camera_model: pinhole\n  distortion_coeffs: [" + kD +
                           "]\n  distortion_model: " + model +
                           "\n  intrinsics: [80, 80, 48, 36]\n  resolution: [96, 72]\n";
  return "cam0:\n" + left + lens + "cam1:\n" + right + lens;
}
const std::string kStepBetween = pose("T_cn_cnm1", "1, 0, 0, -0.11", "0, 1, 0, 0");
std::string camera_info(double p3, const std::string& size = kSize, double scale = 1) {
  const auto n = [&](double v) { return fmt::format("{}", scale * v); };
  return size + "camera_matrix: {rows: 3, cols: 3, data: [" + n(80) + ", 0, " + n(48) + ", 0, " +
         n(80) + ", " + n(36) + ", 0, 0, 1]}\ndistortion_model: plumb_bob\n" +
         "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n" +
         "rectification_matrix: {rows: 3, cols: 3, data: [" + kEye + "]}\n" +
         "projection_matrix: {rows: 3, cols: 4, data: [" + n(80) + ", 0, " + n(48) + ", " + n(p3) +
         ", 0, " + n(80) + ", " + n(36) + ", 0, 0, 0, 1, 0]}\n";
}
std::string echo(double p3, bool ros2, double scale = 1, const std::string& crop = "") {
  const auto list = [&](const char* key, std::vector<double> v, const std::vector<int>& scaled) {
    for (const int i : scaled) v[static_cast<std::size_t>(i)] *= scale;
    const std::string name(1, ros2 ? key[0] : static_cast<char>(key[0] - 'a' + 'A'));
    return ros2 ? name + ":\n- " + fmt::format("{}", fmt::join(v, "\n- ")) + "\n"
                : name + ": [" + fmt::format("{}", fmt::join(v, ", ")) + "]\n";
  };
  return fmt::format("height: {}\nwidth: {}\ndistortion_model: plumb_bob\n", 72 * scale,
                     96 * scale) +
         list("d", {0, 0, 0, 0, 0}, {}) + list("k", {80, 0, 48, 0, 80, 36, 0, 0, 1}, {0, 2, 4, 5}) +
         list("r", {1, 0, 0, 0, 1, 0, 0, 0, 1}, {}) +
         list("p", {80, 0, 48, p3, 0, 80, 36, 0, 0, 0, 1, 0}, {0, 2, 3, 5, 6}) + crop;
}
std::string okvis_camera(double x) {
  return fmt::format(
      "  - {{T_SC: [0, -1, 0, 0, 1, 0, 0, {}, 0, 0, 1, 0, 0, 0, 0, 1], image_dimension: [96, 72],\n"
      "     distortion_coefficients: [{}], distortion_type: radialtangential,\n"
      "     focal_length: [80, 80], principal_point: [48, 36]}}\n",
      x, kD);
}
std::string vins_camera(const std::string& model = "PINHOLE") {
  return "%YAML:1.0\nmodel_type: " + model + "\ncamera_name: c\n" + kSize +
         "distortion_parameters: {k1: -0.1, k2: 0.01, p1: 0, p2: 0}\n"
         "projection_parameters: {fx: 80, fy: 80, cx: 48, cy: 36}\n";
}
const std::string kVins =
    "%YAML:1.0\nnum_of_cam: 2\ncam0_calib: \"c0.yaml\"\ncam1_calib: \"c1.yaml\"\n" +
    matrix("body_T_cam0", 4, 4, "0,-1,0,0, 1,0,0,0, 0,0,1,0, 0,0,0,1") +
    matrix("body_T_cam1", 4, 4, "0,-1,0,0, 1,0,0,0.11, 0,0,1,0, 0,0,0,1");
std::string sensor(double y, const std::string& model = "radial-tangential") {
  return fmt::format(
      "%YAML:1.0\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [0,-1,0,0, 1,0,0,{}, 0,0,1,0, 0,0,0,1]\nresolution: [96, 72]\n"
      "camera_model: pinhole\nintrinsics: [80, 80, 48, 36]\ndistortion_model: {}\n"
      "distortion_coefficients: [{}]\n",
      y, model, kD);
}

using Files = std::vector<std::pair<std::string, std::string>>;
/// Files by name; those whose names begin with + lie beside and are not given.
Case calibration(const char* name, const Files& files, std::string mentions = "0.11 m",
                 int code = 0, const std::string& options = "") {
  return {name,
          [=](const TemporaryFolder& f) {
            std::string given;
            for (const auto& [file, content] : files) {
              const bool beside = file.starts_with('+');
              f.write(file.substr(beside ? 1 : 0), content);
              if (!beside) given += (given.empty() ? "@/" : ",@/") + file;
            }
            return "calibrate convert '" + given + "' @/out.yaml --to vergence " + options;
          },
          code, std::move(mentions)};
}

std::vector<Case> calibrations() {
  // In a body turned by 90° against the camera.
  const auto inertial = [](const std::string& x) {
    return pose("T_imu_cam", "0, -1, 0, 0", "1, 0, 0, " + x);
  };
  const std::string cam0 = pose("T_cam_imu", "0, 1, 0, 0", "-1, 0, 0, 0"),
                    cam1 = pose("T_cam_imu", "0, 1, 0, -0.11", "-1, 0, 0, 0");
  const std::string xml = [] {
    const auto element = [](const char* key, int rows, int columns, std::string data) {
      std::replace(data.begin(), data.end(), ',', ' ');
      return fmt::format(
          "<{0} type_id=\"opencv-matrix\"><rows>{1}</rows><cols>{2}</cols><dt>d</dt><data>{3}"
          "</data></{0}>\n",
          key, rows, columns, data);
    };
    return "<?xml version=\"1.0\"?>\n<opencv_storage>\n" + element("M1", 3, 3, kK) +
           element("D1", 1, 4, kD) + element("M2", 3, 3, kK) + element("D2", 1, 4, kD) +
           element("R", 3, 3, kEye) + element("T", 3, 1, "-0.11, 0, 0") +
           "<imageSize>96 72</imageSize>\n</opencv_storage>\n";
  }();
  const std::string lists =
      R"({"cameraMatrix1": [[80, 0, 48], [0, 80, 36], [0, 0, 1]], "distCoeffs1": [[-0.1, 0.01, 0, 0]],
          "cameraMatrix2": [[80, 0, 48], [0, 80, 36], [0, 0, 1]], "distCoeffs2": [[-0.1, 0.01, 0, 0]],
          "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "T": [[-0.11], [0], [0]], "imageSize": [96, 72]})";
  const std::string orb3 = [] {
    std::string t = "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\n";
    for (const int i : {1, 2})
      t += fmt::format(
          "Camera{0}.fx: 80.0\nCamera{0}.fy: 80.0\nCamera{0}.cx: 48.0\nCamera{0}.cy: 36.0\n"
          "Camera{0}.k1: -0.1\nCamera{0}.k2: 0.01\nCamera{0}.p1: 0.0\nCamera{0}.p2: 0.0\n",
          i);
    return t + "Camera.width: 96\nCamera.height: 72\n" +
           matrix("Stereo.T_c1_c2", 4, 4, "1,0,0,0.11, 0,1,0,0, 0,0,1,0, 0,0,0,1");
  }();
  const auto ost = [](const std::string& side, const std::string& fx_times_b) {
    return "# oST version 5.0 parameters\n\n[image]\n\nwidth\n96\n\nheight\n72\n\n[narrow/" + side +
           "]\n\ncamera matrix\n80 0 48\n0 80 36\n0 0 1\n\ndistortion\n0 0 0 0 0\n\n"
           "rectification\n1 0 0\n0 1 0\n0 0 1\n\nprojection\n80 0 48 " +
           fx_times_b + "\n0 80 36 0\n0 0 1 0\n";
  };
  const auto pair = [](const std::string& l, const std::string& r) {
    return Files{{"left.yaml", l}, {"right.yaml", r}};
  };
  const std::string binned =
      "binning_x: 2\nbinning_y: 2\nroi: {x_offset: 0, y_offset: 0, height: 0, width: 0}\n";
  return {
      calibration("T_imu_cam of both",
                  {{"c.yaml", "%YAML:1.0\n" + kalibr(inertial("0"), inertial("0.11"))}}),
      calibration("T_cam_imu of both", {{"c.yaml", kalibr(cam0, cam1)}}),
      calibration("T_cam_imu of one", {{"c.yaml", kalibr(cam0)}}, "T_cn_cnm1", 2),
      calibration("radial-tangential", {{"c.yaml", kalibr("", kStepBetween, "radial-tangential")}}),
      calibration("plumb_bob", {{"c.yaml", kalibr("", kStepBetween, "plumb_bob")}}),
      calibration("equi", {{"c.yaml", kalibr("", kStepBetween, "equi")}}),
      calibration("double sphere", {{"c.yaml", kalibr("", kStepBetween, "ds")}}, "\"ds\"", 2),
      calibration("rostopic echo", pair(echo(0, false), echo(-8.8, false))),
      calibration("ros2 topic echo", pair(echo(0, true) + "---\n", echo(-8.8, true) + "---\n")),
      calibration("two documents", {{"b.yaml", echo(0, true) + "---\n" + echo(-8.8, true)}}),
      calibration("binned by REP 104", pair(echo(0, true, 2, binned), echo(-8.8, true, 2, binned))),
      calibration("ost.txt", {{"ost.txt", ost("left", "0") + "\n" + ost("right", "-8.8")}}),
      calibration("P in centimetres", pair(camera_info(0), camera_info(-880)),
                  "11 m|unusually long"),
      calibration("sign of P", pair(camera_info(0), camera_info(8.8)), "right.yaml|swapped", 2),
      calibration("P of one in both", pair(camera_info(-8.8), camera_info(-8.8)), "the same P", 2),
      calibration("size of the sensor",
                  pair(camera_info(0, "image_width: 192\nimage_height: 144\n"),
                       camera_info(-8.8, "image_width: 192\nimage_height: 144\n")),
                  "192x144|96x72", 2),
      calibration("M1", {{"c.yml", opencv(kKeys) + kSize}}),
      calibration(
          "left_K",
          {{"c.yml", opencv({"left_K", "left_D", "right_K", "right_D", "R", "T"}) + kSize}}),
      calibration("KL", {{"c.yml", opencv({"KL", "DL", "KR", "DR", "Rot", "Trans"}) + kSize}}),
      calibration("XML", {{"c.xml", xml}}),
      calibration("nested lists", {{"c.json", lists}}),
      calibration("without a size", {{"c.yml", opencv(kKeys)}}, "--size", 2),
      calibration("T in squares", {{"c.yml", opencv(kKeys, "-4.4, 0, 0") + kSize}},
                  "4.4 m|unusually long|squares"),
      calibration("upside down on the right",
                  {{"c.yml", opencv(kKeys, "0.11, 0, 0", "-1, 0, 0, 0, -1, 0, 0, 0, 1") + kSize}}),
      calibration("ORB-SLAM3", {{"c.yaml", orb3}}),
      calibration("ORB-SLAM3, rectified",
                  {{"c.yaml",
                    "%YAML:1.0\nCamera.type: \"Rectified\"\nCamera1.fx: 80.0\nCamera1.fy: "
                    "80.0\nCamera1.cx: 48.0\nCamera1.cy: 36.0\nCamera.width: 96\n"
                    "Camera.height: 72\nStereo.b: 0.11\n"}}),
      calibration("VINS",
                  {{"cfg.yaml", kVins}, {"+c0.yaml", vins_camera()}, {"+c1.yaml", vins_camera()}}),
      calibration(
          "VINS of another lens",
          {{"cfg.yaml", kVins}, {"+c0.yaml", vins_camera("MEI")}, {"+c1.yaml", vins_camera("MEI")}},
          "\"MEI\"", 2),
      calibration("lenses of VINS alone", {{"c0.yaml", vins_camera()}, {"c1.yaml", vins_camera()}},
                  "VINS|body_T_cam0", 2),
      calibration("OKVIS",
                  {{"c.yaml", "%YAML:1.0\ncameras:\n" + okvis_camera(0) + okvis_camera(0.11)}}),
      calibration("EuRoC, Kimera", {{"l.yaml", sensor(0)}, {"r.yaml", sensor(0.11, "radtan")}}),
      calibration("stella_vslam",
                  {{"c.yaml",
                    "Camera: {setup: stereo, model: perspective, fx: 80, fy: 80, cx: 48, cy: 36, "
                    "k1: 0, k2: 0, p1: 0, p2: 0, cols: 96, rows: 72, focal_x_baseline: 8.8}\n"}}),
      calibration(
          "KITTI calib.txt",
          {{"calib.txt", "P0: 80 0 48 0 0 80 36 0 0 0 1 0\nP1: 80 0 48 -8.8 0 80 36 0 0 0 1 0\n"}},
          "0.11 m", 0, "--size 96x72"),
      calibration("ZED", {{"SN1.conf", "[LEFT_CAM_HD]\nfx=80\n[RIGHT_CAM_HD]\nfx=80\n"}}, "ZED", 2),
      calibration("Basalt", {{"c.json", R"({"value0": {"T_imu_cam": [], "intrinsics": []}})"}},
                  "Basalt", 2),
      calibration("DepthAI", {{"c.json", R"({"cameraData": [], "boardName": "x"})"}}, "DepthAI", 2),
  };
}

// ---- images

std::vector<std::uint8_t> grey(int frame, int camera) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto mixed =
          static_cast<std::uint32_t>((x + frame + 3 * camera) / 4 * 7919 + y / 4 * 104729);
      pixels.push_back(static_cast<std::uint8_t>(mixed * 2654435761U >> 24U));
    }
  return pixels;
}
const std::string kLens =
    "size: [96, 72], model: pinhole-radtan, intrinsics: [80, 80, 48, 36], distortion: [0, 0, 0, 0]";
const std::string kOwn =
    "version: 1\nrig: {name: tiny, baseline: 0.11}\ncameras:\n  - {name: left, " + kLens +
    "}\n  - {name: right, " + kLens +
    ", T_camera_left: [1, 0, 0, -0.11, 0, 1, 0, 0, 0, 0, 1, 0]}\n";

/// The name of an image by a pattern: what lines() has, and {side} {c} {L}: left or right, 0 or 1,
/// L or R; {ns} … are `later` ns of the right camera.
std::string image_name(const std::string& pattern, int i, int c, std::int64_t later = 0) {
  const std::int64_t ns = kStart + i * kStep + c * later;
  using fmt::arg;
  return fmt::format(fmt::runtime(pattern), arg("i", i), arg("c", c), arg("c1", c + 1),
                     arg("c2", c + 2), arg("j", i + 100), arg("side", c == 0 ? "left" : "right"),
                     arg("Side", c == 0 ? "Left" : "RIGHT"), arg("L", "LR"[c]), arg("ns", ns),
                     arg("ms", ns / 1'000'000 + c), arg("sec", ns / 1'000'000'000),
                     arg("nsec", ns % 1'000'000'000));
}

struct Images {
  std::string name = "{side}/{i:06}.png";
  /// Lost frame of each camera.
  std::array<int, 2> lost{-1, -1};
  std::int64_t later = 0;
  int channels = 1, depth = CV_8U;
};
void write_images(const TemporaryFolder& f, const Images& images) {
  for (int i = 0; i < kFrames; ++i)
    for (int k = 0; k < 2; ++k) {
      if (images.lost[static_cast<std::size_t>(k)] == i) continue;
      auto pixels = grey(i, k);
      cv::Mat image(kHeight, kWidth, CV_8U, pixels.data()), out = image;
      if (images.depth == CV_16U) image.convertTo(out, CV_16U, 16);
      if (images.channels == 3) cv::merge(std::vector<cv::Mat>{image, image, image}, out);
      const fs::path file = f / image_name(images.name, i, k, images.later);
      fs::create_directories(file.parent_path());
      cv::imwrite(file.string(), out);
    }
}

struct Folder {
  const char* name;
  Images images{};
  /// Pattern of times.txt; empty for no file.
  std::string times = "{ns}";
  /// Parts of the output; a leading `!` expects a refusal.
  std::string mentions{};
  Files more{{"calibration.yaml", kOwn}};
  std::string options{};
};
Case folder(const Folder& row) {
  const bool refused = row.mentions.starts_with('!');
  const auto lost =
      std::count_if(row.images.lost.begin(), row.images.lost.end(), [](int i) { return i >= 0; });
  return {row.name,
          [row](const TemporaryFolder& f) {
            write_images(f, row.images);
            if (!row.times.empty()) f.write("times.txt", lines(row.times, kFrames));
            for (const auto& [file, content] : row.more) f.write(file, content);
            return "replay @ --out @/session " + row.options;
          },
          refused ? 2 : kRead, row.mentions.substr(refused ? 1 : 0),
          kFrames - static_cast<int>(lost)};
}

std::vector<Case> folders() {
  const auto named = [](const std::string& pattern) { return Images{pattern}; };
  const std::string grey_text =
      "P0: 80 0 48 0 0 80 36 0 0 0 1 0\nP1: 80 0 48 -8.8 0 80 36 0 0 0 1 0\n";
  const auto kitti = [&](const std::string& zero, const std::string& one) {
    std::string t = grey_text;
    t.replace(t.find("P1:"), 3, one).replace(t.find("P0:"), 3, zero);
    return Files{{"calib.txt", t}};
  };
  const Images image_0 = named("image_{c}/{i:06}.png");
  Files info{{"l.yaml", camera_info(0)}, {"r.yaml", camera_info(-8.8)}};
  std::vector<Folder> rows{
      {"PGM", named("{side}/{i:06}.pgm")},
      {"PPM", {"{side}/{i:06}.ppm", {-1, -1}, 0, 3}},
      {"PGM of 16 bits", {"{side}/{i:06}.pgm", {-1, -1}, 0, 1, CV_16U}, "{ns}", "16 bits"},
      {"BMP", named("{side}/{i:06}.bmp")},
      {"BMP of 24 bits", {"{side}/{i:06}.BMP", {-1, -1}, 0, 3}},
      {"TIFF", named("{side}/{i:06}.tif"), "{ns}", "!.tif|convert", {}, "--format folder"},
      {"milliseconds apart", named("{side}/{ms}.png"), "",
       "milliseconds in the images' names|nearest stamp"},
      {"nanoseconds apart",
       {"{side}/{ns}.png", {-1, -1}, 312},
       "",
       "nanoseconds in the images' names"},
      {"seconds_nanoseconds", named("{side}/{sec}_{nsec:09}.png"), "",
       "seconds in the images' names"},
      {"one lost on each side", {"{side}/{side}_{i}.png", {2, 4}}, "", "0.1 s apart"},
      {"Left, RIGHT", named("{Side}/{i:06}.png"), "{ns}", "is left and"},
      {"image_left", named("image_{side}/{i:06}.png")},
      {"l, r", named("{L}/{i:06}.png")},
      {"cam0, cam1", named("cam{c}/{i:06}.png")},
      {"camL/img", named("cam{L}/img/{i:06}.png")},
      {"stereo/left", named("stereo/{side}/{i:06}.png")},
      {"4Seasons", named("undistorted_images/cam{c}/{ns}.png"), "{ns} {s} 5.0"},
      {"image_00 without lists", named("image_0{c}/{i:06}.png")},
      {"libviso2", named("I{c1}_{i:06}.png"), "{ns}", "I1_000000.png is left"},
      {"sides at the end", named("{i:06}_{side}.png")},
      {"numbers at the end", named("{i:06}_{c}.png")},
      {"L0000", named("{L}{i:04}.png")},
      {"hidden files",
       {},
       "{ns}",
       "",
       {{"calibration.yaml", kOwn}, {"left/._000000.png", "x"}, {"right/Thumbs.db", "x"}}},
      {"stamp name", {}, "{ns} {i:06}.png"},
      {"index stamp", {}, "{i} {s}", "counts the lines"},
      {"name first", {}, "{i:06}.png,{ns}"},
      {"associations", {}, "{s} left/{i:06}.png {s} right/{i:06}.png"},
      {"two stamps", {}, "{ns} {ns}"},
      {"ms with a point", {}, "{ms:.3f}", "milliseconds"},
      {"ns with a point", {}, "{ns}.000000"},
      {"too few digits", {}, "1.403636585e+09", "!with more digits"},
      {"numbers of frames", {}, "{i}", "!frame numbers"},
      {"lenses only",
       {},
       "{ns}",
       "",
       {{"c.yaml", kalibr()}},
       "--calibration @/c.yaml --from-scratch --baseline 0.11"},
      {"another program's calibration beside",
       {},
       "{ns}",
       "!--calibration|camchain.yaml",
       {{"camchain.yaml", kalibr("", kStepBetween)}}},
      {"a pair of camera_info", {}, "{ns}", "0.11 m", info, "--calibration @/l.yaml,@/r.yaml"},
      {"colour only", named("image_{c2}/{i:06}.png"), "{f:.6e}", "P2 and P3", kitti("P2:", "P3:")},
      {"colour under grey names",
       {"image_{c}/{i:06}.png", {-1, -1}, 0, 3},
       "{f:.6e}",
       "P2 and P3",
       kitti("P0:", "P1:")},
      {"no times", image_0, "", "0.1 s apart", kitti("P0:", "P1:")},
      {"no colon", image_0, "{f:.6e}", {}, kitti("P0", "P1")},
      {"names of the raw data", image_0, "{f:.6e}", {}, kitti("P_rect_00 :", "P_rect_01 :")},
      {"an excerpt", named("image_{c}/{j:06}.png"), "{f:.6e}", "number 100", kitti("P0:", "P1:")},
  };
  struct Euroc {
    const char* name;
    std::int64_t later;
    /// Pattern of the list; empty for no list.
    std::string list;
    std::string mentions;
  };
  for (const Euroc& e :
       {Euroc{"EuRoC, 2 ms later", 2'000'000, "{ns},{ns}.png\r\n", "later by 2 ms"},
        Euroc{"EuRoC, 15 ms later", 15'000'000, "{ns} {ns}.png\n", "differ by 15 ms"},
        Euroc{"EuRoC without names in its list", 0, "{ns}\n", {}},
        Euroc{"EuRoC without its list", 0, "", "nanoseconds in the images' names"}}) {
    Folder row{e.name, {"mav0/cam{c}/data/{ns}.png", {-1, -1}, e.later}, "", e.mentions};
    row.more.clear();
    for (int k = 0; k < 2; ++k) {
      const std::string camera = fmt::format("mav0/cam{}/", k);
      row.more.emplace_back(camera + "sensor.yaml", sensor(k * kBaseline));
      std::string list;
      for (int i = 0; i < kFrames; ++i) list += image_name(e.list, i, k, e.later);
      if (!list.empty())
        row.more.emplace_back(camera + "data.csv", "#timestamp [ns],filename\n" + list);
    }
    rows.push_back(std::move(row));
  }
  const std::string drive = "2014_06_24/2014_06_24_drive_0001_extract/",
                    dates = lines("2014-06-24 18:29:0{t:.3f}", kFrames);
  Files raw{{"2014_06_24/calib_imu_to_velo.txt", "R: 1 0 0 0 1 0 0 0 1\nT: -0.81 0.32 -0.8\n"},
            {"2014_06_24/calib_velo_to_cam.txt", "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.08 -0.27\n"},
            {drive + "oxts/timestamps.txt", dates}};
  std::string cameras;
  for (int k = 0; k < 2; ++k) {
    raw.emplace_back(drive + fmt::format("image_0{}/timestamps.txt", k), dates);
    cameras += fmt::format(
        "S_0{0}: 96 72\nK_0{0}: 80 0 48 0 80 36 0 0 1\nD_0{0}: 0 0 0 0 0\n"
        "R_0{0}: 1 0 0 0 1 0 0 0 1\nT_0{0}: {1} 0 0\nS_rect_0{0}: 64 40\n"
        "R_rect_0{0}: 1 0 0 0 1 0 0 0 1\n",
        k, -kBaseline * k);
  }
  raw.emplace_back("2014_06_24/calib_cam_to_cam.txt", cameras);
  for (int i = 0; i < kFrames; ++i)
    raw.emplace_back(
        drive + fmt::format("oxts/data/{:010}.txt", i),
        fmt::format("{} 8.4 112 0.02 -0.01 1.57 10 0.5 10 0 0.1 0 0 9.8 0 0 9.8 0 0 0 0 0 "
                    "0 0.05 0.03 4 {} 4 4 0\n",
                    49 + 4.5e-6 * i, i == 3 ? 0 : 8));
  rows.push_back({"KITTI raw with its INS", named(drive + "image_0{c}/data/{i:010}.png"), "",
                  "1 of 6 packets have no satellite fix", raw});
  rows.push_back(
      {"St Lucia with its INS",
       named("200101_100000_MultiCamera0/cam{c}_{i}.bmp"),
       "",
       "too slow or too short",
       {{"c.yaml", kOwn},
        {"200101_100000_MultiCamera0.log",
         lines("{sec} {usec} 96 72 GBRG8 {sec} {usec} 96 72 GBRG8 cam0_{i}.bmp cam1_{i}.bmp",
               kFrames)},
        {"200101_100000_Ins0.log",
         lines("{sec} {usec} -27.5 153.0 60 20 1 0 0 0.01 0.02 0.5", kFrames)}},
       "--calibration @/c.yaml"});
  std::vector<Case> all;
  for (const Folder& row : rows) all.push_back(folder(row));
  return all;
}

// ---- bags

struct Bag {
  std::function<std::string(int frame, int camera, std::int64_t ns)> image{};
  const char* type = "sensor_msgs/Image";
  std::array<std::string, 2> topics{"/stereo/left/image_raw", "/stereo/right/image_raw"};
  std::function<std::int64_t(int camera, std::int64_t ns)> recorded = [](int k, std::int64_t ns) {
    return ns + 3'000'000 * (k + 1);
  };
  bool infos = true;
  double fx_times_b = -8.8;
  std::function<void(McapWriter*)> more{};
};

/// Pixels of so many bytes, the grey value the last of them.
std::string raw(const std::string& encoding, int bytes, int i, int k, std::int64_t ns) {
  ImageMessage m{kWidth, kHeight, static_cast<std::uint32_t>(kWidth * bytes), encoding, {}};
  for (const std::uint8_t v : grey(i, k)) {
    m.data.append(static_cast<std::size_t>(bytes) - 1, '\x80');
    m.data.push_back(static_cast<char>(v));
  }
  return image_message(Wire::cdr, ns, m);
}
std::string mono(int i, int k, std::int64_t ns) { return raw("mono8", 1, i, k, ns); }
std::string packed(const std::string& format, const char* ending, int i, int k, std::int64_t ns) {
  auto pixels = grey(i, k);
  std::vector<std::uint8_t> file;
  cv::imencode(ending, cv::Mat(kHeight, kWidth, CV_8U, pixels.data()), file);
  return compressed_message(Wire::cdr, ns, format, std::string(file.begin(), file.end()));
}

Case bag(const char* name, const Bag& b, std::string mentions = "", int code = kRead,
         const std::string& file = "drive.mcap") {
  return {name,
          [=](const TemporaryFolder& f) {
            McapWriter w;
            for (int k = 0; k < 2; ++k) {
              const std::string& topic = b.topics[static_cast<std::size_t>(k)];
              w.channel(static_cast<std::uint16_t>(1 + k), topic, b.type);
              std::string camera = topic;
              if (camera.ends_with("/compressed")) camera.erase(camera.rfind('/'));
              camera.erase(camera.rfind('/'));
              if (camera.ends_with("/image")) camera.replace(camera.rfind('/'), 6, "/info");
              if (!b.infos) continue;
              w.channel(static_cast<std::uint16_t>(3 + k), camera + "/camera_info",
                        "sensor_msgs/CameraInfo");
              CameraInfoMessage info{kWidth, kHeight};
              info.fx = info.fy = kFocal, info.cx = 48, info.cy = 36;
              info.fx_times_b = k == 0 ? 0 : b.fx_times_b;
              w.message(static_cast<std::uint16_t>(3 + k), kStart,
                        camera_info_message(Wire::cdr, kStart, info));
            }
            if (b.more) b.more(&w);
            for (int i = 0; i < kFrames; ++i)
              for (int k = 0; k < 2; ++k) {
                const std::int64_t ns = kStart + i * kStep;
                w.message(static_cast<std::uint16_t>(1 + k), b.recorded(k, ns), b.image(i, k, ns));
              }
            w.finish();
            f.write(file, w.bytes());
            return "replay @/" + file + " --out @/session";
          },
          code, std::move(mentions)};
}

std::vector<Case> bags() {
  std::vector<Case> all;
  all.push_back(bag("a mosaic of 16 bits", {[](int i, int k, std::int64_t ns) {
                      return raw("bayer_rggb16", 2, i, k, ns);
                    }}));
  const std::array<std::string, 2> compressed{"/stereo/left/image_raw/compressed",
                                              "/stereo/right/image_raw/compressed"};
  all.push_back(bag("a mosaic as PNG",
                    {[](int i, int k, std::int64_t ns) {
                       return packed("bayer_rggb8; png compressed ", ".png", i, k, ns);
                     },
                     "sensor_msgs/CompressedImage", compressed},
                    "mosaics"));
  all.push_back(bag("a mosaic as JPEG",
                    {[](int i, int k, std::int64_t ns) {
                       return packed("bayer_rggb8; jpeg compressed ", ".jpg", i, k, ns);
                     },
                     "sensor_msgs/CompressedImage", compressed},
                    "as JPEG, which mixes"));
  all.push_back(bag("stamps of zero", {[](int i, int k, std::int64_t) { return mono(i, k, 0); }},
                    "6 images have no stamp|later by 3 ms"));
  const auto later = [](std::int64_t ms) {
    return [ms](int i, int k, std::int64_t ns) { return mono(i, k, ns + k * ms * 1'000'000); };
  };
  all.push_back(bag("20 ms later", {later(20)}, "differ by 20 ms"));
  for (const std::int64_t ms : {24, 26, 12345})
    all.push_back(bag("stamps that do not tell", {later(ms)},
                      "recording time, because their stamps are ambiguous"));
  Bag ambiguous{later(24)};
  ambiguous.recorded = [](int k, std::int64_t ns) { return ns + k * 24'000'000; };
  all.push_back(bag("nor do recordings", ambiguous, "24 ms later|ambiguous", 2));
  all.push_back(bag("a frame later", {later(51)}, "a frame early or late", kRead));
  all.back().frames = kFrames - 1;
  Bag wrong{.image = mono, .fx_times_b = -880};
  all.push_back(bag("P in centimetres", wrong, "11 m|unusually long"));
  wrong.fx_times_b = 8.8;
  all.push_back(bag("sign of P", wrong, "/stereo/right/camera_info|--calibration", 2));
  for (const auto& [left, right] :
       {std::pair{"/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw"},
        std::pair{"/rig/Infrared_1/image/data", "/rig/Infrared_2/image/data"},
        std::pair{"/cam0/image_raw", "/cam1/image_raw"}})
    all.push_back(
        bag("the usual topics", {mono, "sensor_msgs/Image", {left, right}}, "is left and"));
  Bag none{.image = mono, .infos = false};
  all.push_back(bag("no CameraInfo", none, "CameraInfo|--calibration", 2));
  all.push_back(bag("packed messages", {[](int, int, std::int64_t) {
                      return std::string("\x28\xB5\x2F\xFD") + std::string(60, 'x');
                    }},
                    "MESSAGE", 2));
  all.push_back({"a packed file",
                 [](const TemporaryFolder& f) {
                   f.write("d/d_0.mcap.zstd", "x");
                   return std::string("replay @/d --out @/session");
                 },
                 2, "zstd -d"});
  // A car that drives north with an IMU that says nothing, and a receiver without heights.
  Bag identity{mono};
  identity.more = [](McapWriter* w) {
    w->channel(5, "/fix", "sensor_msgs/NavSatFix"), w->channel(6, "/imu", "sensor_msgs/Imu");
    for (int i = 0; i < kFrames; ++i) {
      const std::int64_t ns = kStart + i * kStep;
      w->message(5, ns,
                 fix_message(Wire::cdr, ns,
                             {0, 49 + 12.0 * i / 111'200, 8.4, i == 3 ? std::nan("") : 300, 1e-4}));
      w->message(6, ns, imu_message(Wire::cdr, ns, {0, 0, 0, 1}, 0));
    }
  };
  all.push_back(bag("constant attitude and a fix without a height", identity,
                    "is not used, because it differs"));
  return all;
}

// ---- boards

std::vector<Case> boards() {
  const auto board = [](const char* name, const std::string& square, std::string mentions,
                        int code) {
    return Case{
        name,
        [=](const TemporaryFolder& f) {
          cv::Mat image(240, 320, CV_8U, cv::Scalar(200));
          for (int y = 0; y < 7; ++y)
            for (int x = 0; x < 10; ++x)
              if ((x + y) % 2 == 0) image(cv::Rect(30 + 25 * x, 30 + 25 * y, 25, 25)).setTo(20);
          for (int i = 0; i < 5; ++i)
            for (const char* side : {"left", "right"})
              cv::imwrite((f / fmt::format("{}{}.png", side, i)).string(), image);
          return "calibrate target --left '@/left*.png' --right '@/right*.png' --checkerboard 9x6 "
                 "--square " +
                 square + " --out @/c.yaml";
        },
        code, std::move(mentions)};
  };
  return {board("one view repeated", "0.025", "the views do not determine", 1),
          board("a square in millimetres", "25", "metres", 2),
          board("a square of a metre", "1", "unusually large", 1)};
}

class Input : public ::testing::TestWithParam<Case> {};

TEST_P(Input, inputIsReadOrRefusedWithItsReason) {
  const Case& c = GetParam();
  const TemporaryFolder f;
  std::string words = c.build(f);
  for (std::size_t i = words.find('@'); i != std::string::npos; i = words.find('@'))
    words.replace(i, 1, f.path().string());
  const Outcome o = run_vergence(words);
  if (c.code == kRead)
    EXPECT_TRUE(o.code == 0 || o.code == 1) << o.code << o.err;
  else
    EXPECT_EQ(o.code, c.code) << o.err;
  std::istringstream parts(c.mentions);
  for (std::string part; std::getline(parts, part, '|');)
    EXPECT_TRUE(test::mentions(o.err + o.out, part)) << part << '\n' << o.err << o.out;
  for (const char sign : o.err + o.out)
    ASSERT_TRUE(sign == '\n' || sign == '\t' || static_cast<unsigned char>(sign) >= 0x20)
        << "a raw byte";
  if (c.code != kRead || !words.starts_with("replay")) return;
  const auto summary = nlohmann::json::parse(read_file(f / "session/summary.json"));
  EXPECT_EQ(summary["frames"]["read"], c.frames) << o.err;
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& some : {trajectories(), calibrations(), folders(), bags(), boards()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}
INSTANTIATE_TEST_SUITE_P(PeopleHave, Input, ::testing::ValuesIn(cases()));

}  // namespace
}  // namespace vergence::test
