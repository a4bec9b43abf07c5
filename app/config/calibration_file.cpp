#include "app/config/calibration_file.hpp"

#include <limits>

#include <yaml-cpp/yaml.h>

#include "app/config/calibration_checks.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/transform_rows.hpp"

namespace vergence::app {
namespace {

// ---- group `covariance`: the joint covariance of a rig's parameters. `parameters` names the rows
// by camera and parameter (`right.rx`, `left.k1`), `upper` has the upper triangle row by row. Names
// that two cameras share are numbered. Rotations in rad and translations in m are left
// perturbations; intrinsics are in px or without unit.

constexpr std::array kPlaceNames{"rx", "ry", "rz", "tx", "ty", "tz"};
constexpr std::array kRadtanNames{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
constexpr std::array kEquidistantNames{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};

struct NamedRow {
  std::string name;
  int row = 0;
};

/// Every parameter of the rig, in the order of the rows.
std::vector<NamedRow> make_rows(const CalibrationFile& c) {
  const std::vector<std::string> cameras =
      distinct_names({c.names.begin(), c.names.begin() + c.rig.cameras});
  std::vector<NamedRow> rows;
  const auto append = [&](std::size_t k, std::span<const char* const> names, int row) {
    for (const char* name : names) rows.push_back({cameras[k] + "." + name, row++});
  };
  for (std::size_t k = 1; k < cameras.size(); ++k)
    append(k, kPlaceNames, extrinsic_row(static_cast<int>(k)));
  for (std::size_t k = 0; k < cameras.size(); ++k)
    if (c.rig.intrinsics[k].kind == CameraModelKind::pinhole_radtan)
      append(k, kRadtanNames, intrinsic_row(static_cast<int>(k)));
    else
      append(k, kEquidistantNames, intrinsic_row(static_cast<int>(k)));
  return rows;
}

/// The rows that a list of names stands for.
std::vector<NamedRow> read_rows(const YamlFile& file, const YAML::Node& list,
                                const CalibrationFile& calibration) {
  const std::string field = "covariance.parameters";
  const std::vector<NamedRow> known = make_rows(calibration);
  if (!list.IsSequence() || list.size() == 0)
    file.fail(list, field + " is not a list of parameters, like right.rx or left.k1");
  std::vector<NamedRow> rows;
  for (const auto& item : list) {
    const std::string name = file.text(item, field);
    const auto found = std::ranges::find(known, name, &NamedRow::name);
    if (found == known.end()) {
      std::vector<std::string> names;
      for (const NamedRow& row : known) names.push_back(row.name);
      file.fail(item, "{} has \"{}\", which is not a parameter of this rig{}", field,
                name.substr(0, 60), did_you_mean(name, names));
    }
    if (std::ranges::find(rows, found->row, &NamedRow::row) != rows.end())
      file.fail(item, "{} has {} twice; remove one", field, name);
    rows.push_back(*found);
  }
  return rows;
}

/// Empty if no covariance is known.
std::string format_covariance(const CalibrationFile& calibration) {
  const RigCovariance& C = calibration.rig.covariance;
  std::vector<NamedRow> rows = make_rows(calibration);
  std::erase_if(rows, [&C](const NamedRow& r) { return !C.known(r.row); });
  if (rows.empty()) return {};
  std::vector<std::string> names;
  std::string upper;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    names.push_back(yaml_scalar(rows[i].name));
    // One line per row, so that the variance of each parameter is at the start of its line.
    upper += i == 0 ? "\n    " : ",\n    ";
    for (std::size_t j = i; j < rows.size(); ++j)
      upper += fmt::format("{}{}", j == i ? "" : ", ", C(rows[i].row, rows[j].row));
  }
  return fmt::format(
      "covariance:  # joint, with uncertain intrinsics; rad, m, px\n  parameters: [{}]\n  upper: "
      "[{}]\n",
      fmt::join(names, ", "), upper);
}

/// Names, camera models and the number of cameras must be read before.
void read_covariance(const YamlFile& file, const YAML::Node& group, CalibrationFile* calibration) {
  file.check_keys(group, "covariance", {"parameters", "upper"});
  for (const char* key : {"parameters", "upper"})
    if (!group[key])
      file.fail(group, "covariance.{} is missing; add it, or remove the block `covariance`", key);
  const std::vector<NamedRow> rows = read_rows(file, group["parameters"], *calibration);
  const std::size_t n = rows.size(), count = n * (n + 1) / 2;
  const std::vector<double> upper = file.numbers(group["upper"], "covariance.upper", count, count);
  auto next = upper.begin();
  for (std::size_t i = 0; i < n; ++i) {
    if (!(*next > 0))
      file.fail(group["upper"],
                "covariance.upper has {:g} as the variance of {}; it must be positive (upper "
                "triangle, row by row)",
                *next, rows[i].name);
    for (std::size_t j = i; j < n; ++j)
      calibration->rig.covariance.set(rows[i].row, rows[j].row, *next++);
  }
}

/// Scales the rows and columns of translations by a factor.
void scale_lengths(double factor, RigCovariance* covariance) {
  std::array<double, kRigSize> by;
  by.fill(1);
  for (int k = 1; k < kMaxCameras; ++k) std::fill_n(by.begin() + extrinsic_row(k) + 3, 3, factor);
  for (int i = 0; i < kRigSize; ++i)
    for (int j = 0; j <= i; ++j)
      covariance->set(
          i, j,
          (*covariance)(i, j) * by[static_cast<std::size_t>(i)] * by[static_cast<std::size_t>(j)]);
}

/// Removes the covariance of the extrinsics and keeps that of the intrinsics.
void clear_places(RigCovariance* covariance) {
  for (int i = 0; i < kExtrinsicsSize; ++i)
    for (int j = 0; j < kRigSize; ++j) covariance->set(i, j, 0);
}

// ---- the file

constexpr std::int64_t kVersion = 1;
constexpr const char* kRadtan = "pinhole-radtan";
constexpr const char* kEquidistant = "pinhole-equidistant";
// Number of entries in the upper triangle of a 6×6 matrix.
constexpr std::size_t kTriangle = 21;

/// One group of the file: its node, its name in messages, its fields by name.
class Section {
 public:
  Section(const YamlFile& file, const YAML::Node& node, std::string name,
          const std::vector<std::string>& known)
      : file_(file), node_(node), name_(std::move(name)) {
    file_.check_keys(node_, name_.empty() ? "the calibration" : name_, known);
  }

  [[nodiscard]] bool has(const char* key) const { return static_cast<bool>(node_[key]); }
  [[nodiscard]] std::string field(const char* key) const {
    return name_.empty() ? key : name_ + "." + key;
  }
  [[nodiscard]] YAML::Node need(const char* key) const {
    const YAML::Node node = node_[key];
    if (!node) file_.fail(node_, field(key) + " is missing");
    return node;
  }
  [[nodiscard]] double number(const char* key, double otherwise) const {
    return has(key) ? file_.number(node_[key], field(key)) : otherwise;
  }
  [[nodiscard]] std::string text(const char* key, const std::string& otherwise) const {
    return has(key) ? file_.text(node_[key], field(key)) : otherwise;
  }
  [[nodiscard]] std::int64_t integer(const char* key, std::int64_t otherwise,
                                     std::int64_t most) const {
    return has(key) ? file_.integer(node_[key], field(key), 0, most) : otherwise;
  }
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t least,
                                            std::size_t most) const {
    return file_.numbers(need(key), field(key), least, most);
  }
  /// A list that may be left out or empty; *values is then unchanged.
  template <std::size_t N>
  void optional_numbers(const char* key, std::array<double, N>* values, std::size_t least = N,
                        std::size_t most = N) const {
    const YAML::Node node = node_[key];
    if (node && !node.IsNull() && !(node.IsSequence() && node.size() == 0))
      std::ranges::copy(numbers(key, least, most), values->begin());
  }

 private:
  const YamlFile& file_;
  YAML::Node node_;
  std::string name_;
};

Intrinsics read_intrinsics(const YamlFile& file, const Section& camera) {
  // The allowed range of a size is checked with the other values.
  constexpr std::int64_t kAnySize = std::numeric_limits<int>::max();
  Intrinsics k;
  const YAML::Node size = camera.need("size");
  if (!size.IsSequence() || size.size() != 2)
    file.fail(size, camera.field("size") + " is not [width, height]");
  k.width = static_cast<int>(file.integer(size[0], camera.field("size"), -kAnySize, kAnySize));
  k.height = static_cast<int>(file.integer(size[1], camera.field("size"), -kAnySize, kAnySize));

  const YAML::Node model = camera.need("model");
  const std::string word = file.text(model, camera.field("model"));
  if (word == kEquidistant)
    k.kind = CameraModelKind::pinhole_equidistant;
  else if (word != kRadtan)
    file.fail(model, "{} is \"{}\"; use {} or {}", camera.field("model"), word.substr(0, 60),
              kRadtan, kEquidistant);

  const auto f = camera.numbers("intrinsics", 4, 4);
  k.fx = f[0], k.fy = f[1], k.cx = f[2], k.cy = f[3];
  const std::size_t most = k.kind == CameraModelKind::pinhole_radtan ? 5 : 4;
  camera.optional_numbers("distortion", &k.distortion, 4, most);
  camera.optional_numbers("intrinsics_sigma", &k.sigma);
  camera.optional_numbers("distortion_sigma", &k.distortion_sigma, 4, most);
  return k;
}

void read_camera(const YamlFile& file, const YAML::Node& node, std::size_t k,
                 const CalibrationUse& use, CalibrationFile* calibration) {
  std::vector<std::string> known{"name", "serial", "size", "model", "intrinsics", "distortion"};
  known.insert(known.end(), {"intrinsics_sigma", "distortion_sigma"});
  if (k > 0)
    known.insert(known.end(), {"T_camera_left", "sigma_noise", "sigma_total", "covariance_total"});
  // Other programs write the inverse, for which the nearest key would be suggested.
  for (const char* inverse : {"T_left_camera", "T_left_right"})
    if (node.IsMap() && node[inverse])
      file.fail(node[inverse],
                "cameras.{}.{} is the inverse of T_camera_left; invert it to [R^T, -R^T t], so "
                "that X_camera = R X_left + t",
                k, inverse);
  const Section camera(file, node, fmt::format("cameras.{}", k), known);
  RigCalibration& rig = calibration->rig;
  calibration->names[k] = camera.text("name", calibration->names[k]);
  calibration->serials[k] = camera.text("serial", "");
  rig.intrinsics[k] = read_intrinsics(file, camera);
  if (k == 0 || (use.length_only && !camera.has("T_camera_left"))) return;
  if (!camera.has("T_camera_left"))
    file.fail(node, camera.field("T_camera_left") +
                        " is missing; add it, or use --from-scratch to estimate it");
  rig.T_camera_left[k] = transform_of(camera.numbers("T_camera_left", 12, 12));
  camera.optional_numbers("sigma_noise", &rig.sigma_noise[k]);
  camera.optional_numbers("sigma_total", &rig.sigma_total[k]);
  std::array<double, kTriangle> upper{};
  camera.optional_numbers("covariance_total", &upper);
  auto next = upper.begin();
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j)
      rig.covariance_total[k](i, j) = rig.covariance_total[k](j, i) = *next++;
}

void read_found(const YamlFile& file, const YAML::Node& node, CalibrationFile* calibration) {
  const Section found(file, node, "found",
                      {"stamp", "source", "frames", "reprojection_px", "scale_sigma", "inflation"});
  RigCalibration& rig = calibration->rig;
  rig.found = Stamp(found.integer("stamp", 0, std::numeric_limits<std::int64_t>::max()));
  calibration->source = found.text("source", "");
  rig.frames = static_cast<int>(found.integer("frames", 0, std::numeric_limits<int>::max()));
  rig.reprojection_px = found.number("reprojection_px", 0);
  rig.scale_sigma = found.number("scale_sigma", 0);
  rig.inflation = found.number("inflation", 0);
}

/// The node that a dotted field names, or the nearest one above it that is there.
YAML::Node locate(const YAML::Node& root, const std::string& field) {
  YAML::Node node = root;
  for (std::size_t from = 0; from < field.size();) {
    const std::size_t dot = std::min(field.find('.', from), field.size());
    const std::string part = field.substr(from, dot - from);
    // The reference is const because a lookup in a mutable node adds the key.
    const YAML::Node& here = node;
    const YAML::Node below = here.IsSequence() ? here[std::stoul(part)] : here[part];
    if (!below) break;
    node.reset(below);
    from = dot + 1;
  }
  return node;
}

CalibrationFile read_file(const YamlFile& file, const CalibrationUse& use) {
  if (file.root().IsNull()) throw InputError(file.name() + ": is empty; pass a calibration.yaml");
  const Section top(file, file.root(), "",
                    {"version", "rig", "cameras", "covariance", "found", "configured"});
  if (const auto version = file.integer(top.need("version"), "version", 1, 1'000'000);
      version != kVersion)
    file.fail(top.need("version"),
              "version is {}; this program reads version {}; use the program that wrote the file",
              version, kVersion);

  CalibrationFile calibration;
  RigCalibration& rig = calibration.rig;
  const YAML::Node cameras = top.need("cameras");
  if (!cameras.IsSequence())
    file.fail(cameras, "cameras is not a list; begin each camera with `- `");
  if (cameras.size() < 2 || cameras.size() > kMaxCameras)
    file.fail(cameras, "cameras lists {} cameras; a rig has 2 to {}", cameras.size(), kMaxCameras);
  rig.cameras = static_cast<int>(cameras.size());
  for (std::size_t k = 0; k < cameras.size(); ++k)
    read_camera(file, cameras[k], k, use, &calibration);

  if (top.has("covariance")) read_covariance(file, top.need("covariance"), &calibration);

  rig.baseline = rig.T_camera_left[1].t.norm();
  if (top.has("rig")) {
    const Section about(file, top.need("rig"), "rig", {"name", "baseline", "baseline_sigma"});
    calibration.rig_name = about.text("name", "");
    if (about.has("baseline") && about.number("baseline", 0) <= 0)
      file.fail(about.need("baseline"), "rig.baseline must be positive, in metres");
    rig.baseline = about.number("baseline", rig.baseline);
    rig.baseline_sigma = about.number("baseline_sigma", 0);
  }
  if (const YAML::Node configured = file.root()["configured"]) {
    calibration.configured.emplace();
    if (!configured.IsMap()) file.fail(configured, "configured is not a group of keys");
    for (const auto& entry : configured)
      calibration.configured->insert_or_assign(file.text(entry.first, "a key of configured"),
                                               file.text(entry.second, "configured"));
  }
  if (top.has("found")) read_found(file, top.need("found"), &calibration);
  if (use.length_only && !(use.baseline > 0) && !(rig.baseline > 0))
    file.fail(file.root(),
              "has no baseline length (rig.baseline), which images cannot show; pass it with "
              "--baseline M");
  apply_use(use, &rig);
  if (const auto bad = find_implausible(&rig))
    file.fail(locate(file.root(), bad->field), bad->message);
  return calibration;
}

std::string list(std::span<const double> values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

bool any(std::span<const double> values) {
  return std::ranges::any_of(values, [](double v) { return v != 0; });
}

std::string format_camera(const CalibrationFile& calibration, std::size_t k) {
  const Intrinsics& i = calibration.rig.intrinsics[k];
  const bool radtan = i.kind == CameraModelKind::pinhole_radtan;
  const std::size_t coefficients =
      radtan && (i.distortion[4] != 0 || i.distortion_sigma[4] != 0) ? 5 : 4;
  std::string text = fmt::format("  - name: {}\n", yaml_scalar(calibration.names[k]));
  if (!calibration.serials[k].empty())
    text += fmt::format("    serial: {}\n", yaml_scalar(calibration.serials[k]));
  text += fmt::format("    size: [{}, {}]\n    model: {}\n", i.width, i.height,
                      radtan ? kRadtan : kEquidistant);
  text += "    intrinsics: " + list(std::array{i.fx, i.fy, i.cx, i.cy}) + "\n";
  text += "    distortion: " + list(std::span(i.distortion).first(coefficients)) + "\n";
  if (any(i.sigma)) text += "    intrinsics_sigma: " + list(i.sigma) + "\n";
  if (any(i.distortion_sigma))
    text +=
        "    distortion_sigma: " + list(std::span(i.distortion_sigma).first(coefficients)) + "\n";
  return text;
}

std::string format_extrinsics(const RigCalibration& rig, std::size_t k) {
  std::string text = "    T_camera_left: " + list(rows_of(rig.T_camera_left[k])) +
                     "  # X_camera = R X_left + t, rows of [R t], m\n";
  if (any(rig.sigma_noise[k]))
    text += "    sigma_noise: " + list(rig.sigma_noise[k]) + "  # rad, m\n";
  if (any(rig.sigma_total[k])) text += "    sigma_total: " + list(rig.sigma_total[k]) + "\n";
  if (!rig.covariance_total[k].isZero(0)) {
    std::vector<double> triangle;
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) triangle.push_back(rig.covariance_total[k](i, j));
    text += "    covariance_total: " + list(triangle) + "\n";
  }
  return text;
}

}  // namespace

CalibrationFile read_calibration(const std::filesystem::path& path, const CalibrationUse& use) {
  return read_file(YamlFile::read(path), use);
}

CalibrationFile parse_calibration(std::string_view yaml, const std::string& name,
                                  const CalibrationUse& use) {
  return read_file(YamlFile::parse(yaml, name), use);
}

void make_parallel(RigCalibration* rig) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig->cameras); ++k)
    rig->T_camera_left[k] = {Mat3::Identity(), Vec3(-static_cast<double>(k) * rig->baseline, 0, 0)};
}

void apply_use(const CalibrationUse& use, RigCalibration* rig) {
  if (use.baseline > 0) {
    const double had = rig->T_camera_left[1].t.norm();
    const double factor = had > 0 ? use.baseline / had : 1;
    for (std::size_t k = 1; k < static_cast<std::size_t>(rig->cameras); ++k) {
      rig->T_camera_left[k].t *= factor;
      for (std::size_t i = 3; i < 6; ++i)
        rig->sigma_noise[k][i] *= factor, rig->sigma_total[k][i] *= factor;
      rig->covariance_total[k].rightCols<3>() *= factor;
      rig->covariance_total[k].bottomRows<3>() *= factor;
    }
    scale_lengths(factor, &rig->covariance);
    rig->baseline = use.baseline;
  }
  if (!use.length_only) return;
  make_parallel(rig);
  for (auto& sigmas : rig->sigma_noise) sigmas.fill(0);
  for (auto& sigmas : rig->sigma_total) sigmas.fill(0);
  for (Mat6& covariance : rig->covariance_total) covariance.setZero();
  clear_places(&rig->covariance);
  rig->found = Stamp();
  rig->frames = 0;
  rig->reprojection_px = rig->scale_sigma = rig->inflation = 0;
}

std::string format_calibration(const CalibrationFile& calibration) {
  const RigCalibration& rig = calibration.rig;
  const double baseline = rig.baseline > 0 ? rig.baseline : rig.T_camera_left[1].t.norm();
  std::string text = fmt::format("version: {}\nrig: {{name: {}, baseline: {}", kVersion,
                                 yaml_scalar(calibration.rig_name), baseline);
  if (rig.baseline_sigma != 0) text += fmt::format(", baseline_sigma: {}", rig.baseline_sigma);
  text += "}\ncameras:\n";
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    text += format_camera(calibration, k);
    if (k > 0) text += format_extrinsics(rig, k);
  }
  text += format_covariance(calibration);
  text += fmt::format(
      "found: {{stamp: {}, source: {}, frames: {}, reprojection_px: {}, scale_sigma: {}",
      rig.found.ns(), yaml_scalar(calibration.source), rig.frames, rig.reprojection_px,
      rig.scale_sigma);
  if (rig.inflation != 0) text += fmt::format(", inflation: {}", rig.inflation);
  return text + "}\n";
}

void write_calibration(const std::filesystem::path& path, const CalibrationFile& calibration) {
  replace_durably(path, format_calibration(calibration));
}

}  // namespace vergence::app
