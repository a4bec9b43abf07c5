#include "app/config/calibration_covariance.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "app/runtime/nearest.hpp"
#include "core/math/linear_solve.hpp"

namespace vergence::app {

namespace {

// Tolerance for a correlation and for the smallest eigenvalue of the correlation matrix: the
// rounding error of numbers with nine digits.
constexpr double kRounding = 1e-6;
constexpr std::array kPlaceNames{"rx", "ry", "rz", "tx", "ty", "tz"};
constexpr std::array kRadtanNames{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
constexpr std::array kEquidistantNames{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};

struct NamedRow {
  std::string name;
  int row = 0;
};

/// Names that tell the cameras apart and cannot be mistaken for an index.
bool has_row_names(const CalibrationFile& c) {
  const auto plain = [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_' || letter == '-';
  };
  const auto names = std::span(c.names).first(static_cast<std::size_t>(c.rig.cameras));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string& name = names[k];
    if (name.empty() || std::isalpha(static_cast<unsigned char>(name.front())) == 0 ||
        !std::all_of(name.begin(), name.end(), plain) ||
        std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(k), name) !=
            names.begin() + static_cast<std::ptrdiff_t>(k))
      return false;
  }
  return true;
}

template <std::size_t N>
void append_rows(const std::string& camera, const std::array<const char*, N>& names, int first,
                 std::vector<NamedRow>* rows) {
  for (std::size_t i = 0; i < N; ++i)
    rows->push_back({camera + "." + names[i], first + static_cast<int>(i)});
}

/// Every parameter of the rig, in the order of the rows.
std::vector<NamedRow> make_rows(const CalibrationFile& c, bool by_name) {
  const auto camera = [&](int k) {
    return by_name ? c.names[static_cast<std::size_t>(k)] : std::to_string(k);
  };
  std::vector<NamedRow> rows;
  for (int k = 1; k < c.rig.cameras; ++k)
    append_rows(camera(k), kPlaceNames, extrinsic_row(k), &rows);
  for (int k = 0; k < c.rig.cameras; ++k) {
    if (c.rig.intrinsics[static_cast<std::size_t>(k)].kind == CameraModelKind::pinhole_radtan)
      append_rows(camera(k), kRadtanNames, intrinsic_row(k), &rows);
    else
      append_rows(camera(k), kEquidistantNames, intrinsic_row(k), &rows);
  }
  return rows;
}

/// The rows that a list of names stands for.
std::vector<NamedRow> read_rows(const YamlFile& file, const YAML::Node& list,
                                const CalibrationFile& calibration) {
  const std::string field = "covariance.parameters";
  std::vector<NamedRow> known = make_rows(calibration, false);
  if (has_row_names(calibration)) {
    const std::vector<NamedRow> named = make_rows(calibration, true);
    known.insert(known.begin(), named.begin(), named.end());
  }
  std::vector<std::string> names;
  names.reserve(known.size());
  for (const NamedRow& row : known) names.push_back(row.name);

  if (!list.IsSequence() || list.size() == 0)
    file.fail(list, field + " is not a list of parameters, like right.rx or left.k1");
  std::vector<NamedRow> rows;
  for (const auto& item : list) {
    const std::string name = file.text(item, field);
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      file.fail(item, fmt::format("{} has \"{}\", which is not a parameter of this rig{}", field,
                                  name.substr(0, 60), did_you_mean(name, names)));
    const int row = known[static_cast<std::size_t>(found - names.begin())].row;
    if (std::any_of(rows.begin(), rows.end(), [row](const NamedRow& r) { return r.row == row; }))
      file.fail(item, fmt::format("{} has {} twice; remove one", field, name));
    rows.push_back({name, row});
  }
  return rows;
}

/// Rows with a variance, in their order.
std::vector<int> known_rows(const RigCovariance& covariance) {
  std::vector<int> rows;
  for (int row = 0; row < kRigSize; ++row)
    if (covariance.known(row)) rows.push_back(row);
  return rows;
}

}  // namespace

std::string format_covariance(const CalibrationFile& calibration) {
  const RigCovariance& C = calibration.rig.covariance;
  std::vector<NamedRow> rows = make_rows(calibration, has_row_names(calibration));
  std::erase_if(rows, [&C](const NamedRow& r) { return !C.known(r.row); });
  if (rows.empty()) return {};
  std::vector<std::string> names;
  std::string upper;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    names.push_back(rows[i].name);
    // A line a row: a person finds the variance of a parameter at the start of its own.
    upper += i == 0 ? "\n    " : ",\n    ";
    for (std::size_t j = i; j < rows.size(); ++j)
      upper += fmt::format("{}{}", j == i ? "" : ", ", C(rows[i].row, rows[j].row));
  }
  return fmt::format(
      "covariance:  # of all parameters together, wide; rad, m, px\n  parameters: [{}]\n  upper: "
      "[{}]\n",
      fmt::join(names, ", "), upper);
}

void read_covariance(const YamlFile& file, const YAML::Node& group, CalibrationFile* calibration) {
  file.check_keys(group, "covariance", {"parameters", "upper"});
  for (const char* key : {"parameters", "upper"})
    if (!group[key])
      file.fail(
          group,
          fmt::format("covariance.{} is missing; add it, or remove the block `covariance`", key));
  const std::vector<NamedRow> rows = read_rows(file, group["parameters"], *calibration);
  const std::size_t n = rows.size(), count = n * (n + 1) / 2;
  const std::vector<double> upper = file.numbers(group["upper"], "covariance.upper", count, count);
  auto next = upper.begin();
  for (std::size_t i = 0; i < n; ++i) {
    if (!(*next > 0))
      file.fail(group["upper"], fmt::format("covariance.upper has {:g} as the variance of {}; it "
                                            "must be positive (upper triangle, row by row)",
                                            *next, rows[i].name));
    for (std::size_t j = i; j < n; ++j)
      calibration->rig.covariance.set(rows[i].row, rows[j].row, *next++);
  }
}

std::optional<std::string> find_flaw(const RigCovariance& covariance) {
  for (int i = 0; i < kRigSize; ++i)
    for (int j = 0; j <= i; ++j) {
      const double value = covariance(i, j);
      if (!std::isfinite(value)) return "holds a number that is not finite";
      if (i == j && value < 0) return "has a negative variance";
      if (value != 0 && !(covariance.known(i) && covariance.known(j)))
        return "correlates a parameter with one that has no variance";
    }
  const std::vector<int> rows = known_rows(covariance);
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (n == 0) return std::nullopt;
  // Correlations: rad, m and px in one matrix would hide what the small ones do.
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const int a = rows[static_cast<std::size_t>(i)], b = rows[static_cast<std::size_t>(j)];
      correlation(i, j) =
          i == j ? 1.0
                 : covariance(a, b) / std::sqrt(covariance(a, a)) / std::sqrt(covariance(b, b));
      if (!(std::abs(correlation(i, j)) <= 1 + kRounding)) return "has a correlation beyond 1";
    }
  // No eigenvalue is below −kRounding.
  correlation.diagonal().array() += kRounding;
  if (!positive_definite(correlation))
    return "is not positive semidefinite: some combination of its parameters has a negative "
           "variance";
  return std::nullopt;
}

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

void clear_places(RigCovariance* covariance) {
  for (int i = 0; i < kExtrinsicsSize; ++i)
    for (int j = 0; j < kRigSize; ++j) covariance->set(i, j, 0);
}

namespace {

// Limits of an image side in px.
constexpr int kSmallestImage = 16, kLargestImage = 16384;
// Focal length over the larger side: 0.2 is wider than any fisheye lens, 5 a telephoto lens of 11°.
constexpr double kShortestFocal = 0.2, kLongestFocal = 5.0;
// Maximum of fx : fy; half-height (interlaced) images have 2.
constexpr double kLargestAspect = 2.0;
// Shift of a corner of the image by the lens, as a part of its distance from the centre. Strong
// wide-angle lenses reach 0.4.
constexpr double kLargestDistortion = 0.8;
// A rotation is used unchanged if no entry of RᵀR − I exceeds this.
constexpr double kSameRotation = 1e-6;
// Up to this entry of RᵀR − I the nearest rotation is used; a larger one is refused.
constexpr double kNearRotation = 1e-3;
// Baselines in m outside these limits indicate a wrong unit.
constexpr double kShortestBaseline = 0.005, kLongestBaseline = 20;
// Relative tolerance, in addition to four sigmas of the measured length.
constexpr double kBaselineTolerance = 0.02;

using Finding = std::optional<ValidationError>;

Finding finding(const std::string& field, const std::string& message) {
  return ValidationError{field, field + " " + message};
}

template <class Numbers>
bool all_finite(const Numbers& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); });
}

template <class Numbers>
Finding check_sigmas(const Numbers& sigmas, const std::string& field) {
  if (!all_finite(sigmas)) return finding(field, "holds a number that is not finite");
  if (std::any_of(sigmas.begin(), sigmas.end(), [](double v) { return v < 0; }))
    return finding(field, "holds a negative sigma");
  return std::nullopt;
}

/// Returns how far the lens moves the image's farthest corner, as a part of its distance from the
/// principal point. The model is evaluated at the distorted radius, which needs no inversion: good
/// to the factor that the limit leaves.
double corner_distortion(const Intrinsics& k) {
  const double x = std::max(k.cx, k.width - 1 - k.cx) / k.fx,
               y = std::max(k.cy, k.height - 1 - k.cy) / k.fy;
  const double r2 = x * x + y * y, r = std::sqrt(r2);
  const auto& d = k.distortion;
  if (k.kind == CameraModelKind::pinhole_equidistant)
    return std::abs(r2 * (d[0] + r2 * (d[1] + r2 * (d[2] + r2 * d[3]))));
  return std::abs(r2 * (d[0] + r2 * (d[1] + r2 * d[4]))) + 3.0 * r * std::hypot(d[2], d[3]);
}

Finding check_intrinsics(const Intrinsics& k, const std::string& camera) {
  if (std::min(k.width, k.height) < kSmallestImage || std::max(k.width, k.height) > kLargestImage)
    return finding(camera + "size", fmt::format("is {} x {} px; sides of {} to {} are expected",
                                                k.width, k.height, kSmallestImage, kLargestImage));
  const std::string intrinsics = camera + "intrinsics";
  if (!all_finite(std::array{k.fx, k.fy, k.cx, k.cy}))
    return finding(intrinsics, "holds a number that is not finite");
  const double side = std::max(k.width, k.height);
  for (const double f : {k.fx, k.fy}) {
    if (f <= 0)
      return finding(
          intrinsics,
          fmt::format("has the focal length {}; it must be positive (the order is fx, fy, cx, cy)",
                      f));
    if (f < kShortestFocal * side || f > kLongestFocal * side)
      return finding(
          intrinsics,
          fmt::format("has the focal length {} px, which does not fit an image of {} x {}; {:g} to "
                      "{:g} px are expected (the order is fx, fy, cx, cy)",
                      f, k.width, k.height, kShortestFocal * side, kLongestFocal * side));
  }
  if (std::max(k.fx, k.fy) > kLargestAspect * std::min(k.fx, k.fy))
    return finding(
        intrinsics,
        fmt::format("has focal lengths as different as {} and {} (the order is fx, fy, cx, cy)",
                    k.fx, k.fy));
  if (k.cx < 0 || k.cy < 0 || k.cx > k.width - 1 || k.cy > k.height - 1)
    return finding(intrinsics, fmt::format("has its principal point ({}, {}) outside the image of "
                                           "{} x {} (the order is fx, fy, cx, cy)",
                                           k.cx, k.cy, k.width, k.height));
  if (!all_finite(k.distortion))
    return finding(camera + "distortion", "holds a number that is not finite");
  const double shift = corner_distortion(k);
  if (!(shift <= kLargestDistortion))
    return finding(
        camera + "distortion",
        fmt::format("would move a corner of the image by {:.3g} of its distance from the centre; "
                    "up to {} is expected (radtan: k1, k2, p1, p2[, k3]; equidistant: k1 to k4)",
                    shift, kLargestDistortion));
  if (auto bad = check_sigmas(k.sigma, camera + "intrinsics_sigma")) return bad;
  return check_sigmas(k.distortion_sigma, camera + "distortion_sigma");
}

Finding check_rotation(Mat3* R, const std::string& field) {
  const double off = (R->transpose() * *R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(off < kNearRotation))
    return finding(field, fmt::format("has a rotation that is not orthonormal (RᵀR is off the "
                                      "identity by {:.2g}, up to {:.0e} is repaired); "
                                      "are rows and columns in order (r11 r12 r13 t1, r21 …)?",
                                      off, kNearRotation));
  if (R->determinant() < 0)
    return finding(field,
                   "has a rotation that mirrors (determinant -1); check the signs of its rows");
  if (off > kSameRotation) {
    const Svd3 s = svd(*R);
    *R = s.U * s.V.transpose();
  }
  return std::nullopt;
}

Finding check_transform(Transform* T, const std::string& field) {
  if (!T->finite()) return finding(field, "holds a number that is not finite");
  if (auto bad = check_rotation(&T->R, field)) return bad;
  const double length = T->t.norm();
  if (length < kShortestBaseline || length > kLongestBaseline)
    return finding(field, fmt::format("puts the camera {:g} m from the left one; {} to {} m are "
                                      "expected (the translation is in metres)",
                                      length, kShortestBaseline, kLongestBaseline));
  return std::nullopt;
}

/// Camera 1 by the length that was measured and by its side. X_right = R X_left + t.
Finding check_baseline(const RigCalibration& rig) {
  const Vec3& t = rig.T_camera_left[1].t;
  if (!std::isfinite(rig.baseline) || rig.baseline < 0)
    return finding("rig.baseline", "must be a positive number of metres");
  if (auto bad = check_sigmas(std::array{rig.baseline_sigma}, "rig.baseline_sigma")) return bad;
  const double tolerance = kBaselineTolerance * t.norm() + 4.0 * rig.baseline_sigma;
  if (rig.baseline > 0 && std::abs(rig.baseline - t.norm()) > tolerance)
    return finding("rig.baseline", fmt::format("is {:g} m, but cameras.1.T_camera_left has a "
                                               "translation of {:g} m; correct one of them",
                                               rig.baseline, t.norm()));
  // Where camera 1 is, in the axes of camera 0: t has those of camera 1, which may be mounted
  // upside down.
  const Vec3 centre = -(rig.T_camera_left[1].R.transpose() * t);
  if (centre.x() < -0.5 * centre.norm())
    return finding(
        "cameras.1.T_camera_left",
        fmt::format(
            "puts camera 1 {:g} m to the left of camera 0: left and right are swapped, or the "
            "transform is given as its inverse (X_camera = R X_left + t, so a parallel camera on "
            "the right has t1 < 0)",
            -centre.x()));
  return std::nullopt;
}

Finding check_covariance(const Mat6& covariance, const std::string& field) {
  if (!covariance.allFinite()) return finding(field, "holds a number that is not finite");
  if (covariance.diagonal().minCoeff() < 0)
    return finding(field, "has a negative variance on its diagonal");
  return std::nullopt;
}

Finding check_found(const RigCalibration& rig) {
  if (rig.frames < 0) return finding("found.frames", "is negative");
  if (auto bad = check_sigmas(std::array{rig.reprojection_px}, "found.reprojection_px")) return bad;
  if (auto bad = check_sigmas(std::array{rig.scale_sigma}, "found.scale_sigma")) return bad;
  if (!std::isfinite(rig.inflation) || rig.inflation < 0)
    return finding("found.inflation", "must be a number from 0 on");
  return std::nullopt;
}

}  // namespace

std::string baseline_message(const RigCalibration& rig) {
  return fmt::format("the baseline is {:.4g} m", rig.T_camera_left[1].t.norm());
}

std::string baseline_warning(const RigCalibration& rig) {
  // Usual limits in m.
  constexpr double kUsuallyShortest = 0.02, kUsuallyLongest = 2;
  const double length = rig.T_camera_left[1].t.norm();
  if (length >= kUsuallyShortest && length <= kUsuallyLongest) return "";
  return fmt::format(
      "a baseline of {:.4g} m is unusually {}; check that the calibration is in metres, not in {}",
      length, length < kUsuallyShortest ? "short" : "long",
      length < kUsuallyShortest ? "another"
                                : "centimetres, millimetres or squares of a calibration target");
}

std::optional<ValidationError> find_implausible(RigCalibration* rig) {
  if (rig->cameras < 2 || rig->cameras > kMaxCameras)
    return finding("cameras",
                   fmt::format("lists {} cameras; a rig has 2 to {}", rig->cameras, kMaxCameras));
  for (int k = 0; k < rig->cameras; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const std::string camera = fmt::format("cameras.{}.", k);
    if (auto bad = check_intrinsics(rig->intrinsics[i], camera)) return bad;
    if (k == 0) continue;
    if (auto bad = check_transform(&rig->T_camera_left[i], camera + "T_camera_left")) return bad;
    if (auto bad = check_sigmas(rig->sigma_noise[i], camera + "sigma_noise")) return bad;
    if (auto bad = check_sigmas(rig->sigma_total[i], camera + "sigma_total")) return bad;
    if (auto bad = check_covariance(rig->covariance_total[i], camera + "covariance_total"))
      return bad;
  }
  if (const auto flaw = find_flaw(rig->covariance)) return finding("covariance", *flaw);
  if (auto bad = check_baseline(*rig)) return bad;
  return check_found(*rig);
}

}  // namespace vergence::app
