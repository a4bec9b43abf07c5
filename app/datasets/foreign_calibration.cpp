#include "app/datasets/foreign_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/foreign_settings.hpp"
#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/ros_camera.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

// ---- numbers

double number_of(const Fact& fact) { return fact.file->number(fact.node, fact.key); }

[[noreturn]] void fail(const Fact& fact, const std::string& what) {
  fact.file->fail(fact.node, fact.key + what);
}

/// All numbers of a value: a scalar, a list, a list of lists, or `{rows, cols, data}`.
std::vector<double> read_numbers(const Fact& fact) {
  constexpr std::size_t kMax = 64;
  const YAML::Node data = fact.node.IsMap() ? fact.node["data"] : fact.node;
  if (data.IsScalar()) return {fact.file->number(data, fact.key)};
  std::vector<double> values;
  for (const auto& item : data) {
    const auto row = item.IsSequence() ? fact.file->numbers(item, fact.key, 0, kMax)
                                       : std::vector{fact.file->number(item, fact.key)};
    values.insert(values.end(), row.begin(), row.end());
    if (values.size() > kMax) fail(fact, " has too many numbers");
  }
  if (fact.node.IsMap())
    if (const YAML::Node rows = fact.node["rows"], columns = fact.node["cols"]; rows && columns)
      if (fact.file->integer(rows, fact.key + ".rows", 0, 1000) *
              fact.file->integer(columns, fact.key + ".cols", 0, 1000) !=
          static_cast<std::int64_t>(values.size()))
        fail(fact, ".data is not a list of rows x cols numbers");
  return values;
}

std::vector<double> read_numbers(const Fact& fact, std::size_t count, const char* what) {
  auto values = read_numbers(fact);
  if (values.size() != count)
    fail(fact, fmt::format(" has {} numbers; {} is expected", values.size(), what));
  return values;
}

/// Converts a matrix of 3 x 3 numbers, or a rotation vector.
Mat3 to_rotation(const Fact& fact) {
  const auto v = read_numbers(fact);
  if (v.size() == 3) return exp_so3(Vec3(v[0], v[1], v[2]));
  if (v.size() != 9) fail(fact, " is neither a matrix of 3 x 3 numbers nor a rotation vector");
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

/// Converts a matrix of 4 x 4 numbers, or of 3 x 4 without the last row.
Transform to_transform(const Fact& fact) {
  const auto v = read_numbers(fact);
  if (v.size() != 12 && v.size() != 16) fail(fact, " is not a matrix of 4 x 4 numbers");
  if (v.size() == 16 && (v[12] != 0 || v[13] != 0 || v[14] != 0 || v[15] != 1))
    fail(fact, " does not end with the row 0 0 0 1");
  Transform T;
  T.R << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  T.t << v[3], v[7], v[11];
  // find_implausible() refuses other matrices.
  if (accept_rotation(T.R)) T.R = normalised(T.R);
  return T;
}

// ---- the parts

bool is_lens(const Fact& fact) {
  return fact.part == "matrix" || fact.part == "fx" || fact.part == "focal";
}

/// Assigns facts without a camera to the camera of their file or document, if at least two of these
/// have intrinsics without a camera.
std::vector<Fact> with_cameras(const std::vector<YamlFile>& files) {
  const auto nameless = [](const std::vector<Fact>& facts) {
    return std::ranges::any_of(facts, [](const Fact& f) { return is_lens(f) && !f.camera; });
  };
  std::vector<std::vector<Fact>> of_files(files.size());
  std::ranges::transform(files, of_files.begin(), find_facts);
  const bool one_each = std::ranges::count_if(of_files, nameless) > 1;
  std::vector<Fact> all;
  int camera = 0;
  for (std::vector<Fact>& facts : of_files) {
    const bool of_camera = one_each && nameless(facts);
    for (Fact& fact : facts) {
      if (of_camera && !fact.camera) fact.camera = camera;
      all.push_back(std::move(fact));
    }
    camera += of_camera ? 1 : 0;
  }
  return all;
}

// ---- lenses

std::string join_names(const std::vector<YamlFile>& files) {
  std::string names;
  for (const YamlFile& file : files)
    if (names.find(file.name()) == std::string::npos)
      names += (names.empty() ? "" : ", ") + file.name();
  return names;
}

[[noreturn]] void fail_missing(const std::vector<YamlFile>& files, const std::string& what) {
  bool never = false;
  for (const YamlFile& file : files)
    if (const std::string program = find_program(file, &never); !program.empty())
      refuse(join_names(files), 0, "{} is missing; the file {}", what, program);
  refuse(join_names(files), 0,
         "{} is missing; supported are calibration.yaml, Kalibr, ROS camera_info, OpenCV (M1 D1 M2 "
         "D2 R T), EuRoC, KITTI, ORB-SLAM, VINS and Kimera",
         what);
}

/// Reads intrinsics and transforms of one calibration.
class RigReader {
 public:
  RigReader(const std::vector<YamlFile>& files, const std::optional<ImageSize>& size,
            const CalibrationUse& use, Remarks* remarks)
      : files_(files), size_(size), use_(use), remarks_(remarks), facts_(with_cameras(files)) {}

  CalibrationFile read() {
    int cameras = 0;
    for (const Fact& fact : facts_)
      if (is_lens(fact) && fact.camera) cameras = std::max(cameras, *fact.camera + 1);
    // A rectified pair has one set of intrinsics and a baseline.
    const bool one_for_both = cameras < 2 && find("fx", 0) != nullptr &&
                              (own("focal_baseline", std::nullopt) != nullptr ||
                               own("baseline", std::nullopt) != nullptr);
    if (one_for_both) {
      cameras = 2;
      // Values of camera 0 apply to both cameras.
      for (Fact& fact : facts_)
        if (fact.camera == 0) fact.camera.reset();
    }
    // The message about an unsupported model is more specific than the one about missing
    // intrinsics, so it comes first.
    for (int k = 0; k < 2; ++k) (void)model(k);
    if (cameras < 2) fail_missing(files_, "the camera matrix of a second camera");
    if (cameras > kMaxCameras)
      refuse(join_names(files_), 0, "has {} cameras; a rig has at most {}", cameras, kMaxCameras);
    RigCalibration& rig = out_.rig;
    rig.cameras = cameras;
    for (int k = 0; k < cameras; ++k) {
      read_lens(k);
      if (const Fact* name = own("name", k))
        out_.names[static_cast<std::size_t>(k)] = name->file->text(name->node, name->key);
    }
    if (use_.length_only && use_.baseline > 0) {
      rig.baseline = use_.baseline;
      make_parallel(&rig);
    } else {
      for (int k = 1; k < cameras; ++k) read_place(k);
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] const Fact* own(std::string_view part, std::optional<int> camera) const {
    for (const Fact& fact : facts_)
      if (fact.part == part && fact.camera == camera) return &fact;
    return nullptr;
  }
  /// Value of this camera, or else one without a camera.
  [[nodiscard]] const Fact* find(std::string_view part, int camera) const {
    const Fact* fact = own(part, camera);
    return fact != nullptr ? fact : own(part, std::nullopt);
  }
  Intrinsics& lens(int k) { return out_.rig.intrinsics[static_cast<std::size_t>(k)]; }
  Transform& place(int k) { return out_.rig.T_camera_left[static_cast<std::size_t>(k)]; }

  void read_lens(int k) {
    std::array<double, 4> fx_fy_cx_cy{};
    if (const Fact* matrix = find("matrix", k)) {
      const auto v = read_numbers(*matrix);
      if (v.size() == 4)
        std::ranges::copy(v, fx_fy_cx_cy.begin());
      else if (v.size() == 9 && v[1] == 0 && v[3] == 0 && v[6] == 0 && v[7] == 0 && v[8] == 1)
        fx_fy_cx_cy = {v[0], v[4], v[2], v[5]};
      else
        fail(*matrix, " is neither fx fy cx cy nor [fx 0 cx; 0 fy cy; 0 0 1]");
    } else {
      const Fact *focal = find("focal", k), *centre = find("centre", k);
      for (std::size_t i = 0; i < 4; ++i) {
        constexpr std::array<std::string_view, 4> kEach{"fx", "fy", "cx", "cy"};
        if (const Fact* fact = find(kEach[i], k)) {
          fx_fy_cx_cy[i] = number_of(*fact);
          continue;
        }
        const Fact* list = i < 2 ? focal : centre;
        if (list == nullptr) fail_missing(files_, fmt::format("the camera matrix of camera {}", k));
        const auto values = read_numbers(*list);
        if (values.empty() || (values.size() < 2 && list == centre))
          fail(*list, " is not a list of two numbers");
        fx_fy_cx_cy[i] = values[std::min(i % 2, values.size() - 1)];
      }
    }
    std::tie(lens(k).fx, lens(k).fy, lens(k).cx, lens(k).cy) = std::tuple_cat(fx_fy_cx_cy);
    read_distortion(k);
    read_size(k);
  }

  /// Camera model according to the file; empty if it states none. *none is set if the file states
  /// that there is no distortion.
  std::optional<CameraModelKind> model(int k, bool* none = nullptr) const {
    std::optional<CameraModelKind> found;
    // The distortion model counts; `pinhole` is listed next to it.
    for (const std::string_view part : {"camera_model", "distortion_model", "fisheye"}) {
      const Fact* fact = find(part, k);
      if (fact == nullptr || !fact->node.IsScalar()) continue;
      std::string word = fact->file->text(fact->node, fact->key);
      if (part == "fisheye")
        word = fact->file->integer(fact->node, fact->key, 0, 1) == 1 ? "fisheye" : "radtan";
      const auto kind = lens_model(word);
      const bool of_rays = part != "camera_model";
      // A `type` may be that of something else.
      const bool stated = of_rays || fact->key.find("odel") != std::string::npos ||
                          fact->key.find("amera.type") != std::string::npos;
      if (!kind && stated)
        fail(*fact, fmt::format(" is \"{}\"; supported is pinhole with radtan (plumb_bob), "
                                "equidistant (fisheye, Kannala-Brandt) or no distortion",
                                word.substr(0, 60)));
      if (none != nullptr)
        *none = *none || word == "none" || word == "Rectified" || (word.empty() && of_rays);
      if (kind && !(found && word.empty())) found = kind;
    }
    return found;
  }

  void read_distortion(int k) {
    bool none = false;
    const auto stated = model(k, &none);
    const bool equidistant = stated == CameraModelKind::pinhole_equidistant;
    if (equidistant) lens(k).kind = CameraModelKind::pinhole_equidistant;
    if (none) return;
    const Fact* list = find("distortion", k);
    std::vector<double> values;
    if (list != nullptr) {
      values = read_numbers(*list);
    } else {
      // The order is that of radtan. Equidistant models have k1 to k4, or k2 to k5 if the angle
      // itself counts as the first.
      using Names = std::vector<std::string_view>;
      const Names names = !equidistant ? Names{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}
                          : find("k1", k) != nullptr ? Names{"k1", "k2", "k3", "k4"}
                                                     : Names{"k2", "k3", "k4", "k5"};
      bool any = false;
      for (const std::string_view name : names) {
        const Fact* fact = find(name, k);
        any = any || fact != nullptr;
        values.push_back(fact == nullptr ? 0 : number_of(*fact));
      }
      if (!any)
        fail_missing(files_, fmt::format("the list of distortion coefficients of camera {}", k));
    }
    if (!stated && values.size() == 4 && k == 0)
      remarks_->push_back(
          join_names(files_) +
          ": four distortion coefficients are read as k1 k2 p1 p2 (radtan); if they are k1 k2 k3 "
          "k4 of cv::fisheye, add the line `fisheye_model: 1`, else `fisheye_model: 0`");
    if (const std::string fault =
            set_ros_distortion(equidistant ? "equidistant" : "radtan", values, &lens(k));
        !fault.empty()) {
      if (list != nullptr) fail(*list, " " + fault);
      refuse(join_names(files_), 0, "the list of distortion coefficients {}", fault);
    }
  }

  void read_size(int k) {
    // In px.
    constexpr double kLargest = 1 << 16;
    const Fact *width = find("width", k), *height = find("height", k), *size = find("size", k);
    if (width == nullptr || height == nullptr) width = size;
    std::vector<double> sides;
    if (width == nullptr && size_)
      sides = {static_cast<double>(size_->width), static_cast<double>(size_->height)};
    else if (width == nullptr)
      refuse(join_names(files_), 0,
             "has no image size (OpenCV's sample writes none); add --size WIDTHxHEIGHT");
    else
      sides = width == size ? read_numbers(*size, 2, "[width, height]")
                            : std::vector{number_of(*width), number_of(*height)};
    for (const double side : sides)
      if (!(side >= 1 && side <= kLargest) || side != std::floor(side))
        fail(*width, " is not an image size; two positive numbers are expected");
    lens(k).width = static_cast<int>(sides[0]), lens(k).height = static_cast<int>(sides[1]);
  }

  // ---- where camera k sits

  void read_place(int k) {
    if (from_previous(k) ||
        (k == 1 && (from_rotation() || from_between() || from_rectification())) || from_body(k) ||
        (k == 1 && from_baseline()))
      return;
    fail_missing(files_,
                 fmt::format("the transform of camera {} from the left one, or P of both,", k));
  }

  bool from_previous(int k) {
    const Fact* step = own("to_previous", k);
    if (step == nullptr) return false;
    place(k) = to_transform(*step) * place(k - 1);
    return true;
  }

  /// Uses R and T of OpenCV.
  bool from_rotation() {
    const Fact *R = own("rotation", std::nullopt), *T = own("translation", std::nullopt);
    if (R == nullptr || T == nullptr) {
      if (R != T && find("projection", 1) == nullptr)
        fail_missing(files_, fmt::format("{} of camera 2 from camera 1", R == nullptr ? "R" : "T"));
      return false;
    }
    place(1).R = to_rotation(*R);
    const auto t = read_numbers(*T, 3, "a vector of 3");
    place(1).t = {t[0], t[1], t[2]};
    return true;
  }

  bool from_between() {
    for (const Fact& fact : facts_)
      if (fact.part == "between") {
        Transform T = to_transform(fact);
        place(1) = fact.index == 1 ? T : T.inverse();
        return true;
      }
    return false;
  }

  /// Uses R and P of both cameras (ROS, ORB-SLAM). If R and T exist, R1, R2, P1 and P2 are not
  /// needed.
  bool from_rectification() {
    std::array<RosCamera, 2> cameras;
    for (int k = 0; k < 2; ++k) {
      RosCamera& camera = cameras[static_cast<std::size_t>(k)];
      const Fact* P = own("projection", k);
      if (P == nullptr) return false;
      const auto p = read_numbers(*P, 12, "a matrix of 3 x 4");
      camera.P = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(p.data());
      if (!(camera.P(0, 0) > 0 && camera.P(1, 1) > 0)) fail(*P, " has no positive focal lengths");
      camera.lens = lens(k);
      const Fact* R = own("rectification", k);
      if (R == nullptr) R = own("rotation", k);
      if (R != nullptr) {
        camera.R = to_rotation(*R);
        if (camera.R.isZero(0) && is_rectified(camera)) camera.R.setIdentity();
        if (!((camera.R.transpose() * camera.R - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-3))
          fail(*R, " is not a rotation");
      }
      apply_camera_crop(k, &camera);
    }
    const Fact* P = own("projection", 1);
    if (const std::string fault = set_ros_rig(cameras[0], cameras[1], &out_.rig); !fault.empty())
      fail(*P, " " + fault + " (" + own("projection", 0)->file->name() + " is the left camera's)");
    return true;
  }

  void apply_camera_crop(int k, RosCamera* camera) {
    RosCrop crop;
    for (const auto& [part, value] : {std::pair{"binning_x", &crop.binning_x},
                                      {"binning_y", &crop.binning_y},
                                      {"roi_x", &crop.x},
                                      {"roi_y", &crop.y},
                                      {"roi_width", &crop.width},
                                      {"roi_height", &crop.height}})
      if (const Fact* fact = own(part, k))
        *value = static_cast<std::uint32_t>(fact->file->integer(fact->node, fact->key, 0, 1 << 20));
    if (std::string remark = apply_crop(crop, size_, camera); !remark.empty())
      remarks_->push_back(join_names(files_) + ": " + remark);
  }

  /// Uses the transforms of both cameras in a body.
  bool from_body(int k) {
    const auto T_body_camera = [this](int camera) -> std::optional<Transform> {
      if (const Fact* fact = own("from_body", camera)) return to_transform(*fact).inverse();
      if (const Fact* fact = own("to_body", camera)) return to_transform(*fact);
      return std::nullopt;
    };
    const auto left = T_body_camera(0), other = T_body_camera(k);
    if (!left || !other) return false;
    place(k) = other->inverse() * *left;
    if (accept_rotation(place(k).R)) place(k).R = normalised(place(k).R);
    return true;
  }

  /// Uses a baseline length, which is all that a rectified pair has.
  bool from_baseline() {
    const Fact *length = own("baseline", std::nullopt),
               *focal = own("focal_baseline", std::nullopt);
    if (length == nullptr && focal == nullptr) return false;
    // If the file also has intrinsics of the raw images, the focal length is that of the rectified
    // ones.
    const Fact* rectified = own("fx", std::nullopt);
    const double fx = rectified != nullptr ? number_of(*rectified) : lens(0).fx;
    const double b = length != nullptr ? number_of(*length) : number_of(*focal) / fx;
    Mat3 R_rectified[2] = {Mat3::Identity(), Mat3::Identity()};
    for (int k = 0; k < 2; ++k)
      if (const Fact* R = own("rotation", k)) R_rectified[k] = to_rotation(*R);
    place(1).R = R_rectified[1].transpose() * R_rectified[0];
    place(1).t = R_rectified[1].transpose() * Vec3(-b, 0, 0);
    return true;
  }

  const std::vector<YamlFile>& files_;
  const std::optional<ImageSize>& size_;
  const CalibrationUse& use_;
  Remarks* remarks_;
  std::vector<Fact> facts_;
  CalibrationFile out_;
};

// ---- files

/// Reads a KITTI text, whose lines are `P0: numbers`; empty if it is another text.
std::optional<RigCalibration> read_kitti_text(const std::string& name, const std::string& text,
                                              const std::optional<ImageSize>& size) {
  Lines lines(text);
  std::string_view line;
  if (!lines.next(&line) || !(line.starts_with("P0") || line.starts_with("P2") ||
                              line.starts_with("calib_time") || line.starts_with("S_00")))
    return std::nullopt;
  const bool colour = line.starts_with("P2");
  return read_kitti_projections(name, {colour ? 2 : 0, colour ? 3 : 1}, size);
}

/// Adds the files that a configuration names, which are next to it.
void add_named_files(std::vector<YamlFile>* files) {
  std::vector<YamlFile> named;
  for (const YamlFile& file : *files)
    for (const Fact& fact : find_facts(file)) {
      if (fact.part != "file" || !fact.node.IsScalar()) continue;
      const fs::path path =
          fs::path(file.name()).parent_path() / fs::path(fact.node.Scalar()).filename();
      for (YamlFile& tree : settings_trees(read_text(path, kLargestYaml), path.string()))
        named.push_back(std::move(tree));
    }
  for (YamlFile& tree : named) files->push_back(std::move(tree));
}

/// Throws InputError if the principal point is in the middle of a half or a quarter of the image:
/// the intrinsics are then those of binned images, but the size is that of the sensor.
void check_binning(const std::string& name, const Intrinsics& lens) {
  // Share of the image.
  constexpr double kNear = 0.12;
  const auto off = [&](double parts) {
    return std::max(std::abs(parts * lens.cx / lens.width - 0.5),
                    std::abs(parts * lens.cy / lens.height - 0.5));
  };
  for (const int parts : {2, 4})
    if (off(1) > 2 * kNear - 0.01 && off(parts) < kNear)
      refuse(name, 0,
             "the size is {}x{}, but the principal point ({:.1f}, {:.1f}) is the centre of {}x{}; "
             "the camera matrix is probably of binned images, so write their size",
             lens.width, lens.height, lens.cx, lens.cy, lens.width / parts, lens.height / parts);
}

/// Files of an argument; a directory stands for its left.yaml and right.yaml. Commas separate files
/// unless one has the whole name.
std::vector<fs::path> split_files(const std::string& text) {
  std::error_code ignored;
  if (fs::is_directory(text, ignored))
    return {fs::path(text) / "left.yaml", fs::path(text) / "right.yaml"};
  if (fs::exists(text, ignored)) return {text};
  std::vector<fs::path> files;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) files.emplace_back(part);
  return files.empty() ? std::vector<fs::path>{text} : files;
}

}  // namespace

bool is_own_calibration(const fs::path& file) {
  const auto trees = settings_trees(read_text(file, kLargestYaml), file.string());
  return std::ranges::any_of(trees, [](const YamlFile& tree) {
    const YAML::Node& root = tree.root();
    return root.IsMap() && root["cameras"] && !root["cameras"].IsScalar() &&
           (root["version"] || root["rig"]);
  });
}

CalibrationFile parse_any_calibration(const std::vector<CalibrationText>& texts,
                                      const std::optional<ImageSize>& size, Remarks* remarks,
                                      const CalibrationUse& use) {
  if (texts.empty()) throw InputError("no calibration file is named; pass one");
  CalibrationFile out;
  std::optional<RigCalibration> kitti;
  std::vector<YamlFile> files;
  for (const CalibrationText& text : texts) {
    if ((kitti = read_kitti_text(text.name, text.text, size))) break;
    for (YamlFile& tree : settings_trees(text.text, text.name)) files.push_back(std::move(tree));
  }
  if (kitti) {
    out.rig = *kitti;
  } else {
    if (files.empty()) refuse(texts.front().name, 0, "is empty; pass a calibration");
    for (const YamlFile& file : files) {
      bool never = false;
      if (!file.root().IsMap())
        refuse(file.name(), 0,
               "is not a calibration: it has no lines `key: value`; pass a calibration.yaml, or a "
               "file of Kalibr, ROS or OpenCV");
      if (const std::string program = find_program(file, &never); never)
        refuse(file.name(), 0, program);
    }
    add_named_files(&files);
    out = RigReader(files, size, use, remarks).read();
  }
  const std::string& name = texts.back().name;
  for (const Intrinsics& lens : out.rig.intrinsics)
    if (lens.width > 0 && lens.height > 0) check_binning(name, lens);
  out.source = "given";
  out.rig.baseline = out.rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&out.rig))
    refuse(name, 0, "converted to calibration.yaml: {}", bad->message);
  apply_use(use, &out.rig);
  return out;
}

Transform read_body_mount(const fs::path& file) {
  const auto trees = settings_trees(read_text(file, kLargestYaml), file.string());
  for (const YamlFile& tree : trees)
    for (const Fact& fact : find_facts(tree)) {
      if (fact.part != "to_body") continue;
      Transform T = to_transform(fact);
      if (!accept_rotation(T.R)) fail(fact, " is not a rigid transform");
      return T;
    }
  refuse(file, 0, "has no T_BS, the pose of the camera in the body");
}

CalibrationFile read_any_calibration(const std::string& in, const std::optional<ImageSize>& size,
                                     Remarks* remarks, const CalibrationUse& use) {
  std::error_code ignored;
  if (fs::is_regular_file(in, ignored) && is_own_calibration(in)) return read_calibration(in, use);
  std::vector<CalibrationText> texts;
  for (const fs::path& path : split_files(in))
    texts.push_back({path.string(), read_text(path, kLargestYaml)});
  return parse_any_calibration(texts, size, remarks, use);
}

}  // namespace vergence::app
