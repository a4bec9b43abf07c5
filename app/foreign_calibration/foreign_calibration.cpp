#include "app/foreign_calibration/foreign_calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>
#include <tuple>

#include <fmt/format.h>

#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/ros_camera.hpp"
#include "app/datasets/text_file.hpp"
#include "app/foreign_calibration/settings_tree.hpp"
#include "app/foreign_calibration/vocabulary.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

/// What stands before the image, which cameras of a rig do not share: `/stereo/left/image_raw` →
/// `left`; where no part is called an image, the last one. Empty: nothing stands there.
std::string name_in(const std::string& topic) {
  std::string name;
  for (const fs::path& part : fs::path(topic).relative_path()) {
    if (part.string().starts_with("image")) break;
    name = part.string();
  }
  return name;
}

// ---- numbers

/// All numbers of a value: a list, a list of lists, or `{rows, cols, data}`.
std::vector<double> numbers_of(const Fact& fact) {
  constexpr std::size_t kMost = 64;
  const YAML::Node data = fact.node.IsMap() ? fact.node["data"] : fact.node;
  if (data.IsScalar()) return {fact.file->number(data, fact.key)};
  std::vector<double> values;
  for (const auto& item : data) {
    if (item.IsSequence()) {
      const auto row = fact.file->numbers(item, fact.key, 0, kMost);
      values.insert(values.end(), row.begin(), row.end());
    } else {
      values.push_back(fact.file->number(item, fact.key));
    }
    if (values.size() > kMost) fact.file->fail(fact.node, fact.key + " has too many numbers");
  }
  if (fact.node.IsMap())
    if (const YAML::Node rows = fact.node["rows"], columns = fact.node["cols"]; rows && columns)
      if (fact.file->integer(rows, fact.key + ".rows", 0, 1000) *
              fact.file->integer(columns, fact.key + ".cols", 0, 1000) !=
          static_cast<std::int64_t>(values.size()))
        fact.file->fail(fact.node, fact.key + ".data is not a list of rows x cols numbers");
  return values;
}

std::vector<double> numbers_of(const Fact& fact, std::size_t count, const char* what) {
  auto values = numbers_of(fact);
  if (values.size() != count)
    fact.file->fail(
        fact.node, fmt::format("{} has {} numbers; {} is expected", fact.key, values.size(), what));
  return values;
}

Mat3 matrix_of(std::span<const double> v) {
  Mat3 R;
  R << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  return R;
}

/// 4x4, or 3x4 without its last row.
Transform transform_of(const Fact& fact) {
  const auto v = numbers_of(fact);
  if (v.size() != 12 && v.size() != 16)
    fact.file->fail(fact.node, fact.key + " is not a matrix of 4 x 4 numbers");
  if (v.size() == 16 && (v[12] != 0 || v[13] != 0 || v[14] != 0 || v[15] != 1))
    fact.file->fail(fact.node, fact.key + " does not end with the row 0 0 0 1");
  Transform T;
  T.R << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  T.t << v[3], v[7], v[11];
  return T;
}

// ---- the parts

/// What the files say, by part and camera.
class Parts {
 public:
  explicit Parts(std::vector<Fact> facts) : facts_(std::move(facts)) {}

  /// Of this camera, else of none in particular.
  [[nodiscard]] const Fact* find(Part part, int camera) const {
    const Fact* shared = nullptr;
    for (const Fact& fact : facts_) {
      if (fact.part != part) continue;
      if (fact.camera == camera) return &fact;
      if (!fact.camera && shared == nullptr) shared = &fact;
    }
    return shared;
  }
  [[nodiscard]] const Fact* own(Part part, std::optional<int> camera) const {
    for (const Fact& fact : facts_)
      if (fact.part == part && fact.camera == camera) return &fact;
    return nullptr;
  }
  [[nodiscard]] const std::vector<Fact>& all() const { return facts_; }
  /// What is of camera 0 becomes both cameras'.
  void share_first() {
    for (Fact& fact : facts_)
      if (fact.camera == 0) fact.camera.reset();
  }

 private:
  std::vector<Fact> facts_;
};

bool is_lens(const Fact& fact) {
  return fact.part == Part::matrix || fact.part == Part::fx || fact.part == Part::focal;
}

/// Facts that name no camera are of the camera whose file or document they stand in, where two of
/// these have lenses without a name.
std::vector<Fact> with_cameras(const std::vector<YamlFile>& files) {
  std::vector<std::vector<Fact>> of_files;
  std::size_t nameless = 0;
  const auto has_nameless_lens = [](const std::vector<Fact>& facts) {
    return std::any_of(facts.begin(), facts.end(),
                       [](const Fact& f) { return is_lens(f) && !f.camera; });
  };
  for (const YamlFile& file : files) {
    of_files.push_back(facts_of(file));
    nameless += has_nameless_lens(of_files.back()) ? 1 : 0;
  }
  std::vector<Fact> all;
  int camera = 0;
  for (std::vector<Fact>& facts : of_files) {
    const bool of_camera = nameless > 1 && has_nameless_lens(facts);
    for (Fact& fact : facts) {
      if (of_camera && !fact.camera) fact.camera = camera;
      all.push_back(std::move(fact));
    }
    camera += of_camera ? 1 : 0;
  }
  return all;
}

// ---- lenses

std::string names_of(const std::vector<YamlFile>& files) {
  std::string names;
  for (const YamlFile& file : files)
    if (names.find(file.name()) == std::string::npos)
      names += (names.empty() ? "" : ", ") + file.name();
  return names;
}

[[noreturn]] void fail_missing(const std::vector<YamlFile>& files, const std::string& what) {
  bool never = false;
  for (const YamlFile& file : files)
    if (const std::string program = program_of(file, &never); !program.empty())
      throw InputError(
          fmt::format("{}: {} is missing; the file {}", names_of(files), what, program));
  throw InputError(fmt::format(
      "{}: {} is missing; calibrations that are read: calibration.yaml, Kalibr, ROS camera_info, "
      "OpenCV (M1 D1 M2 D2 R T), EuRoC, KITTI, ORB-SLAM, VINS, Kimera",
      names_of(files), what));
}

/// Reads the lenses and transforms of one calibration.
class RigReader {
 public:
  RigReader(const std::vector<YamlFile>& files, const std::optional<ImageSize>& size,
            const CalibrationUse& use, Remarks* remarks)
      : files_(files), size_(size), use_(use), remarks_(remarks), parts_(with_cameras(files)) {}

  CalibrationFile read() {
    int cameras = 0;
    for (const Fact& fact : parts_.all())
      if (is_lens(fact) && fact.camera) cameras = std::max(cameras, *fact.camera + 1);
    // A rectified pair has one lens and a baseline.
    const bool one_for_both = cameras < 2 && parts_.find(Part::fx, 0) != nullptr &&
                              (parts_.own(Part::focal_baseline, std::nullopt) != nullptr ||
                               parts_.own(Part::baseline, std::nullopt) != nullptr);
    if (one_for_both) {
      cameras = 2;
      parts_.share_first();
    }
    // A model that is not read says more than the lens that is not found.
    for (int k = 0; k < 2; ++k) (void)model(k);
    if (cameras < 2) fail_missing(files_, "the lens of a second camera");
    if (cameras > kMaxCameras)
      throw InputError(fmt::format("{}: has {} cameras; a rig has up to {}", names_of(files_),
                                   cameras, kMaxCameras));
    RigCalibration& rig = out_.rig;
    rig.cameras = cameras;
    for (int k = 0; k < cameras; ++k) {
      read_lens(k);
      read_name(k);
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
  Intrinsics& lens(int k) { return out_.rig.intrinsics[static_cast<std::size_t>(k)]; }
  Transform& place(int k) { return out_.rig.T_camera_left[static_cast<std::size_t>(k)]; }

  void read_lens(int k) {
    std::array<double, 4> fx_fy_cx_cy{};
    if (const Fact* matrix = parts_.find(Part::matrix, k)) {
      const auto v = numbers_of(*matrix);
      if (v.size() == 4)
        std::copy(v.begin(), v.end(), fx_fy_cx_cy.begin());
      else if (v.size() == 9 && v[1] == 0 && v[3] == 0 && v[6] == 0 && v[7] == 0 && v[8] == 1)
        fx_fy_cx_cy = {v[0], v[4], v[2], v[5]};
      else
        matrix->file->fail(matrix->node,
                           matrix->key + " is neither fx fy cx cy nor [fx 0 cx; 0 fy cy; 0 0 1]");
    } else {
      const Fact *focal = parts_.find(Part::focal, k), *centre = parts_.find(Part::centre, k);
      for (std::size_t i = 0; i < 4; ++i) {
        constexpr std::array kEach{Part::fx, Part::fy, Part::cx, Part::cy};
        if (const Fact* fact = parts_.find(kEach[i], k)) {
          fx_fy_cx_cy[i] = fact->file->number(fact->node, fact->key);
          continue;
        }
        const Fact* list = i < 2 ? focal : centre;
        if (list == nullptr) fail_missing(files_, fmt::format("the camera matrix of camera {}", k));
        const auto values = numbers_of(*list);
        if (values.empty() || (values.size() < 2 && list == centre))
          list->file->fail(list->node, list->key + " is not a list of two numbers");
        fx_fy_cx_cy[i] = values[std::min(i % 2, values.size() - 1)];
      }
    }
    std::tie(lens(k).fx, lens(k).fy, lens(k).cx, lens(k).cy) = std::tuple_cat(fx_fy_cx_cy);
    read_distortion(k);
    read_size(k);
  }

  /// The lens model that the file says; nothing: it says none. *none: it says that there is no
  /// distortion.
  std::optional<CameraModelKind> model(int k, bool* none = nullptr) const {
    std::optional<CameraModelKind> found;
    // What bends the rays counts; `pinhole` stands beside it.
    for (const Part part : {Part::camera_model, Part::distortion_model}) {
      const Fact* fact = parts_.find(part, k);
      if (fact == nullptr || !fact->node.IsScalar()) continue;
      const std::string word = fact->file->text(fact->node, fact->key);
      const auto kind = lens_model(word);
      const bool of_rays = part == Part::distortion_model;
      const bool said = of_rays || fact->key.find("odel") != std::string::npos ||
                        fact->key.find("amera.type") != std::string::npos;
      if (!kind && said)
        fact->file->fail(fact->node,
                         fmt::format("{} is \"{}\"; lenses that are read are pinhole with radtan "
                                     "(plumb_bob) or equidistant (fisheye, Kannala-Brandt) "
                                     "distortion, or none",
                                     fact->key, word.substr(0, 60)));
      if (none != nullptr)
        *none = *none || word == "none" || word == "Rectified" || (word.empty() && of_rays);
      if (kind && !(found && word.empty())) found = kind;
    }
    if (const Fact* fact = parts_.find(Part::fisheye, k))
      found = fact->file->integer(fact->node, fact->key, 0, 1) == 1
                  ? CameraModelKind::pinhole_equidistant
                  : CameraModelKind::pinhole_radtan;
    return found;
  }

  void read_distortion(int k) {
    bool none = false;
    const auto said = model(k, &none);
    const bool equidistant = said == CameraModelKind::pinhole_equidistant;
    if (equidistant) lens(k).kind = CameraModelKind::pinhole_equidistant;
    if (none) return;
    const Fact* list = parts_.find(Part::distortion, k);
    std::vector<double> values;
    if (list != nullptr) {
      values = numbers_of(*list);
    } else {
      std::map<int, double> by_place;
      for (const bool own : {false, true})
        for (const Fact& fact : parts_.all())
          if (fact.part == Part::coefficient && (own ? fact.camera == k : !fact.camera))
            by_place[fact.index] = fact.file->number(fact.node, fact.key);
      if (by_place.empty())
        fail_missing(files_, fmt::format("the list of distortion coefficients of camera {}", k));
      // In radtan's order; an equidistant lens has k1 … k4, or k2 … k5 of those who count the angle
      // itself as the first.
      using Places = std::vector<int>;
      for (const int place : !equidistant           ? Places{0, 1, 2, 3, 4, 5, 6, 7}
                             : by_place.contains(0) ? Places{0, 1, 4, 5}
                                                    : Places{1, 4, 5, 6})
        values.push_back(by_place[place]);
    }
    if (!said && values.size() == 4 && k == 0)
      remarks_->push_back(
          names_of(files_) +
          ": four distortion coefficients are taken for k1 k2 p1 p2 (radtan); if they are k1 k2 k3 "
          "k4 of cv::fisheye, add the line `fisheye_model: 1`, else `fisheye_model: 0`");
    if (const std::string fault =
            set_ros_distortion(equidistant ? "equidistant" : "radtan", values, &lens(k));
        !fault.empty()) {
      if (list != nullptr) list->file->fail(list->node, list->key + " " + fault);
      throw InputError(names_of(files_) + ": the list of distortion coefficients " + fault);
    }
  }

  void read_size(int k) {
    const auto side = [](const Fact& fact, double value) {
      constexpr double kLargest = 1 << 16;  // px
      if (!(value >= 1 && value <= kLargest) || value != std::floor(value))
        fact.file->fail(fact.node, fact.key + " is no size of an image");
      return static_cast<int>(value);
    };
    const Fact *width = parts_.find(Part::width, k), *height = parts_.find(Part::height, k),
               *size = parts_.find(Part::size, k);
    if (width != nullptr && height != nullptr) {
      lens(k).width = side(*width, width->file->number(width->node, width->key));
      lens(k).height = side(*height, height->file->number(height->node, height->key));
    } else if (size != nullptr) {
      const auto values = numbers_of(*size, 2, "[width, height]");
      lens(k).width = side(*size, values[0]), lens(k).height = side(*size, values[1]);
    } else if (size_) {
      lens(k).width = size_->width, lens(k).height = size_->height;
    } else {
      throw InputError(names_of(files_) +
                       ": holds no image size, as OpenCV's sample writes none; add --size "
                       "WIDTHxHEIGHT");
    }
  }

  void read_name(int k) {
    const auto text = [&](Part part) {
      const Fact* fact = parts_.own(part, k);
      return fact == nullptr ? std::string() : fact->file->text(fact->node, fact->key);
    };
    std::string& name = out_.names[static_cast<std::size_t>(k)];
    for (const std::string& own : {name_in(text(Part::topic)), text(Part::name)})
      if (!own.empty()) name = own;
  }

  // ---- where camera k sits

  void read_place(int k) {
    if (from_previous(k) ||
        (k == 1 && (from_rotation() || from_between() || from_rectification())) || from_body(k) ||
        (k == 1 && from_baseline()))
      return;
    const bool ros =
        parts_.find(Part::rectification, 1) != nullptr || parts_.own(Part::rotation, 1) != nullptr;
    fail_missing(files_, ros ? "the projection (projection_matrix, P) of a stereo calibration"
                             : fmt::format("the transform of camera {} from the left one", k));
  }

  bool from_previous(int k) {
    const Fact* step = parts_.own(Part::to_previous, k);
    if (step == nullptr) return false;
    place(k) = transform_of(*step) * place(k - 1);
    if (k == 1 && std::any_of(parts_.all().begin(), parts_.all().end(), [](const Fact& f) {
          return f.part == Part::from_body || f.part == Part::other;
        }))
      remarks_->push_back(step->file->name() +
                          ": T_cam_imu and timeshift_cam_imu are left out; comparison and ins have "
                          "keys for an INS");
    return true;
  }

  /// OpenCV's R, T.
  bool from_rotation() {
    const Fact *R = parts_.own(Part::rotation, std::nullopt),
               *T = parts_.own(Part::translation, std::nullopt);
    if ((R == nullptr) != (T == nullptr) && parts_.find(Part::projection, 1) == nullptr)
      fail_missing(files_, R == nullptr ? "the rotation of camera 2 from camera 1 (R)"
                                        : "the translation of camera 2 from camera 1 (T)");
    if (R == nullptr || T == nullptr) return false;
    const auto r = numbers_of(*R);
    if (r.size() != 9 && r.size() != 3)
      R->file->fail(R->node,
                    R->key + " is neither a matrix of 3 x 3 numbers nor a rotation vector");
    place(1).R = r.size() == 9 ? matrix_of(r) : exp_so3(Vec3(r[0], r[1], r[2]));
    const auto t = numbers_of(*T, 3, "a vector of 3");
    place(1).t = {t[0], t[1], t[2]};
    return true;
  }

  bool from_between() {
    for (const Fact& fact : parts_.all())
      if (fact.part == Part::between) {
        const Transform T = transform_of(fact);
        place(1) = fact.index == 1 ? T : T.inverse();
        return true;
      }
    return false;
  }

  /// ROS's R and P of both, and ORB-SLAM's; R1, R2, P1, P2 beside R and T are not needed.
  bool from_rectification() {
    std::array<RosCamera, 2> cameras;
    for (int k = 0; k < 2; ++k) {
      RosCamera& camera = cameras[static_cast<std::size_t>(k)];
      const Fact* P = parts_.own(Part::projection, k);
      if (P == nullptr) return false;
      const auto p = numbers_of(*P, 12, "a matrix of 3 x 4");
      camera.P << p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11];
      if (!(camera.P(0, 0) > 0 && camera.P(1, 1) > 0))
        P->file->fail(P->node, P->key + " has no positive focal lengths");
      camera.lens = lens(k);
      const Fact* R = parts_.own(Part::rectification, k);
      if (R == nullptr) R = parts_.own(Part::rotation, k);
      if (R != nullptr) {
        camera.R = matrix_of(numbers_of(*R, 9, "a matrix of 3 x 3"));
        if (camera.R.isZero(0) && is_rectified(camera)) camera.R.setIdentity();
        if (!((camera.R.transpose() * camera.R - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-3))
          R->file->fail(R->node, R->key + " is not a rotation");
      }
      apply_crop_of(k, &camera);
    }
    const Fact* P = parts_.own(Part::projection, 1);
    if (const std::string fault = set_ros_rig(cameras[0], cameras[1], &out_.rig); !fault.empty())
      P->file->fail(P->node, P->key + " " + fault + " (" +
                                 parts_.own(Part::projection, 0)->file->name() +
                                 " is the left camera's)");
    return true;
  }

  void apply_crop_of(int k, RosCamera* camera) {
    RosCrop crop;
    for (const auto& [part, value] :
         {std::pair{Part::binning_x, &crop.binning_x}, std::pair{Part::binning_y, &crop.binning_y},
          std::pair{Part::roi_x, &crop.x}, std::pair{Part::roi_y, &crop.y},
          std::pair{Part::roi_width, &crop.width}, std::pair{Part::roi_height, &crop.height}})
      if (const Fact* fact = parts_.own(part, k))
        *value = static_cast<std::uint32_t>(fact->file->integer(fact->node, fact->key, 0, 1 << 20));
    if (std::string taken = apply_crop(crop, size_, camera); !taken.empty())
      remarks_->push_back(names_of(files_) + ": " + taken);
  }

  /// From where both cameras sit in a body.
  bool from_body(int k) {
    std::array<std::optional<Transform>, 2> T_camera_body;
    for (std::size_t i = 0; i < 2; ++i) {
      const int camera = i == 0 ? 0 : k;
      if (const Fact* fact = parts_.own(Part::from_body, camera))
        T_camera_body[i] = transform_of(*fact);
      else if (const Fact* inverse = parts_.own(Part::to_body, camera))
        T_camera_body[i] = transform_of(*inverse).inverse();
    }
    if (!T_camera_body[0] || !T_camera_body[1]) return false;
    place(k) = *T_camera_body[1] * T_camera_body[0]->inverse();
    return true;
  }

  /// Of a rectified pair only the length is written.
  bool from_baseline() {
    const Fact *length = parts_.own(Part::baseline, std::nullopt),
               *focal = parts_.own(Part::focal_baseline, std::nullopt);
    if (length == nullptr && focal == nullptr) return false;
    // Where lenses of the raw images stand beside it, the focal length is that of the rectified
    // one.
    const Fact* rectified = parts_.own(Part::fx, std::nullopt);
    const double fx = rectified != nullptr
                          ? rectified->file->number(rectified->node, rectified->key)
                          : lens(0).fx;
    const double b = length != nullptr ? length->file->number(length->node, length->key)
                                       : focal->file->number(focal->node, focal->key) / fx;
    Mat3 R_rectified[2] = {Mat3::Identity(), Mat3::Identity()};
    for (int k = 0; k < 2; ++k)
      if (const Fact* R = parts_.own(Part::rotation, k))
        R_rectified[k] = matrix_of(numbers_of(*R, 9, "a matrix of 3 x 3"));
    place(1).R = R_rectified[1].transpose() * R_rectified[0];
    place(1).t = R_rectified[1].transpose() * Vec3(-b, 0, 0);
    return true;
  }

  const std::vector<YamlFile>& files_;
  const std::optional<ImageSize>& size_;
  const CalibrationUse& use_;
  Remarks* remarks_;
  Parts parts_;
  CalibrationFile out_;
};

// ---- files

/// KITTI's text, whose lines are `P0: numbers`; nothing: it is none.
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

/// The files that a configuration names, which lie beside it.
void add_named_files(std::vector<YamlFile>* files) {
  std::vector<YamlFile> named;
  for (const YamlFile& file : *files)
    for (const Fact& fact : facts_of(file)) {
      if (fact.part != Part::file || !fact.node.IsScalar()) continue;
      const fs::path path =
          fs::path(file.name()).parent_path() / fs::path(fact.node.Scalar()).filename();
      for (YamlFile& tree : settings_trees(read_text(path, kLargestYaml), path.string()))
        named.push_back(std::move(tree));
    }
  for (YamlFile& tree : named) files->push_back(std::move(tree));
}

/// A lens in the middle of a half or a quarter of its image is one of binned images, whose file has
/// the size of the sensor.
void check_binning(const std::string& name, const Intrinsics& lens) {
  constexpr double kNear = 0.12;  // of the image
  const auto off = [&](double parts) {
    return std::max(std::abs(parts * lens.cx / lens.width - 0.5),
                    std::abs(parts * lens.cy / lens.height - 0.5));
  };
  for (const int parts : {2, 4})
    if (off(1) > 2 * kNear - 0.01 && off(parts) < kNear)
      throw InputError(fmt::format(
          "{}: the size is {}x{}, but the principal point ({:.1f}, {:.1f}) is the middle of {}x{}: "
          "the camera matrix is probably that of binned images; write their size",
          name, lens.width, lens.height, lens.cx, lens.cy, lens.width / parts,
          lens.height / parts));
}

void finish(const std::string& name, const CalibrationUse& use, CalibrationFile* calibration) {
  for (const Intrinsics& lens : calibration->rig.intrinsics)
    if (lens.width > 0 && lens.height > 0) check_binning(name, lens);
  calibration->source = "given";
  calibration->rig.baseline = calibration->rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&calibration->rig))
    throw InputError(fmt::format("{}: in the words of calibration.yaml, {}", name, bad->sentence));
  apply_use(use, &calibration->rig);
}

std::vector<CalibrationText> texts_of(const std::string& in) {
  std::vector<CalibrationText> texts;
  std::error_code ignored;
  for (const fs::path& path : detail::files_of(in, fs::is_directory(in, ignored)))
    texts.push_back({path.string(), read_text(path, kLargestYaml)});
  return texts;
}

bool is_own(const YamlFile& file) {
  return file.root().IsMap() && file.root()["cameras"] && !file.root()["cameras"].IsScalar() &&
         (file.root()["version"] || file.root()["rig"]);
}

}  // namespace

namespace detail {

std::vector<std::filesystem::path> files_of(const std::string& text, bool folder) {
  if (folder) return {fs::path(text) / "left.yaml", fs::path(text) / "right.yaml"};
  std::error_code ignored;
  if (fs::exists(text, ignored)) return {text};  // a name may have a comma, too
  std::vector<fs::path> files;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) files.emplace_back(part);
  return files.empty() ? std::vector<fs::path>{text} : files;
}

}  // namespace detail

bool is_own_calibration(const fs::path& file) {
  const std::string text = read_text(file, kLargestYaml);
  for (const YamlFile& tree : settings_trees(text, file.string()))
    if (is_own(tree)) return true;
  return false;
}

CalibrationFile parse_any_calibration(const std::vector<CalibrationText>& texts,
                                      const std::optional<ImageSize>& size, Remarks* remarks,
                                      const CalibrationUse& use) {
  if (texts.empty()) throw InputError("no file of a calibration is named");
  std::vector<YamlFile> files;
  for (const CalibrationText& text : texts) {
    if (const auto rig = read_kitti_text(text.name, text.text, size)) {
      CalibrationFile out;
      out.rig = *rig;
      finish(text.name, use, &out);
      return out;
    }
    for (YamlFile& tree : settings_trees(text.text, text.name)) files.push_back(std::move(tree));
  }
  if (files.empty()) throw InputError(texts.front().name + ": is empty; a calibration is expected");
  for (const YamlFile& file : files) {
    bool never = false;
    if (!file.root().IsMap())
      throw InputError(file.name() +
                       ": is not a group of keys (`key: value`); a calibration is expected");
    if (const std::string program = program_of(file, &never); never)
      throw InputError(file.name() + ": " + program);
  }
  add_named_files(&files);
  CalibrationFile out = RigReader(files, size, use, remarks).read();
  finish(texts.back().name, use, &out);
  return out;
}

CalibrationFile read_any_calibration(const std::string& in, const std::optional<ImageSize>& size,
                                     Remarks* remarks, const CalibrationUse& use) {
  const std::vector<CalibrationText> texts = texts_of(in);
  std::error_code ignored;
  if (texts.size() == 1 && fs::is_regular_file(texts[0].name, ignored) &&
      is_own_calibration(texts[0].name))
    return read_calibration(texts[0].name, use);
  return parse_any_calibration(texts, size, remarks, use);
}

}  // namespace vergence::app
