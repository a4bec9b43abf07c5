#include "app/config/calibration_covariance.hpp"

#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <numeric>

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

}  // namespace

std::string format_covariance(const CalibrationFile& calibration) {
  const RigCovariance& C = calibration.rig.covariance;
  std::vector<NamedRow> rows = make_rows(calibration);
  std::erase_if(rows, [&C](const NamedRow& r) { return !C.known(r.row); });
  if (rows.empty()) return {};
  std::vector<std::string> names;
  std::string upper;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    names.push_back(yaml_scalar(rows[i].name));
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
      file.fail(group, "covariance.{} is missing; add it, or remove the block `covariance`", key);
  const std::vector<NamedRow> rows = read_rows(file, group["parameters"], *calibration);
  const std::size_t n = rows.size(), count = n * (n + 1) / 2;
  const std::vector<double> upper = file.numbers(group["upper"], "covariance.upper", count, count);
  auto next = upper.begin();
  for (std::size_t i = 0; i < n; ++i) {
    if (!(*next > 0))
      file.fail(group["upper"],
                "covariance.upper has {:g} as the variance of {}; it "
                "must be positive (upper triangle, row by row)",
                *next, rows[i].name);
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
  std::vector<int> rows(kRigSize);
  std::iota(rows.begin(), rows.end(), 0);
  std::erase_if(rows, [&](int row) { return !covariance.known(row); });
  const auto n = std::ssize(rows);
  if (n == 0) return std::nullopt;
  // Correlations: rad, m and px in one matrix would hide what the small ones do.
  Eigen::MatrixXd correlation = Eigen::MatrixXd::NullaryExpr(n, n, [&](auto i, auto j) {
    const int a = rows[static_cast<std::size_t>(i)], b = rows[static_cast<std::size_t>(j)];
    return covariance(a, b) / std::sqrt(covariance(a, a)) / std::sqrt(covariance(b, b));
  });
  if (!(correlation.cwiseAbs().maxCoeff() <= 1 + kRounding)) return "has a correlation beyond 1";
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

}  // namespace vergence::app
