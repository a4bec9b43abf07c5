#include "app/recorder/residual_field.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "core/camera/camera.hpp"
#include "core/geometry/epipolar.hpp"

namespace vergence::app {
namespace {

constexpr int kColumns = 8, kRows = 6;
constexpr std::size_t kFewest = 8;     // matches of a cell that has a mean
constexpr double kGross = 4.0;         // standard deviations from the median: a wrong match
constexpr double kLeastScatter = 0.3;  // px: of these, a cell of few matches may seem to have less
constexpr double kSigmaOfMad = 1.4826;

double middle(std::vector<double>* values) {
  const auto at = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), at, values->end());
  return *at;
}

/// Fills in mean and scatter of what is left without gross errors.
void summarise(std::vector<double> values, ResidualCell* cell) {
  const double median = middle(&values);
  std::vector<double> off;
  off.reserve(values.size());
  for (const double v : values) off.push_back(std::abs(v - median));
  const double most = kGross * std::max(kLeastScatter, kSigmaOfMad * middle(&off));
  std::erase_if(values, [&](double v) { return std::abs(v - median) > most; });
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  cell->matches = static_cast<int>(values.size());
  cell->mean_px = sum / cell->matches;
  for (const double v : values) squares += (v - cell->mean_px) * (v - cell->mean_px);
  cell->scatter_px = std::sqrt(squares / cell->matches);
}

/// One further camera's distances, by cell.
class Field {
 public:
  Field(const RigCalibration& rig, int camera)
      : camera_(camera),
        left_(rig.intrinsics[0]),
        other_(rig.intrinsics[static_cast<std::size_t>(camera)]),
        geometry_(rig.T_camera_left[static_cast<std::size_t>(camera)]),
        cells_(std::size_t{kColumns} * kRows) {}

  void add(const RawMatch& m) {
    Vec3 a, b;
    double d = 0;
    const Vec2 left(m.left[0], m.left[1]), other(m.other[0], m.other[1]);
    if (!left_.inside(left, 0) || !left_.unproject(left, &a) || !other_.unproject(other, &b) ||
        geometry_.to_line(a.head<2>() / a.z(), b.head<2>() / b.z(), &d, nullptr) !=
            EpipolarStatus::ok)
      return;
    const Intrinsics& k = left_.intrinsics();
    const int column = std::clamp(static_cast<int>(kColumns * left.x() / k.width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(kRows * left.y() / k.height), 0, kRows - 1);
    cell_at(row, column).push_back(d * other_.intrinsics().fx);
  }

  void append_to(std::vector<ResidualCell>* out) {
    const Intrinsics& k = left_.intrinsics();
    const double width = static_cast<double>(k.width) / kColumns,
                 height = static_cast<double>(k.height) / kRows;
    for (int row = 0; row < kRows; ++row)
      for (int column = 0; column < kColumns; ++column) {
        std::vector<double>& values = cell_at(row, column);
        if (values.size() < kFewest) continue;
        ResidualCell cell{camera_, column * width, row * height, width, height};
        summarise(std::move(values), &cell);
        out->push_back(cell);
      }
  }

 private:
  [[nodiscard]] std::vector<double>& cell_at(int row, int column) {
    return cells_[static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column)];
  }

  int camera_;
  Camera left_, other_;
  EpipolarGeometry geometry_;
  std::vector<std::vector<double>> cells_;
};

void append_rows(const char* when, const std::vector<ResidualCell>& cells, std::string* out) {
  for (const ResidualCell& c : cells)
    fmt::format_to(std::back_inserter(*out), "{},{},{:.2f},{:.2f},{:.2f},{:.2f},{},{:.4f},{:.4f}\n",
                   when, c.camera, c.left, c.top, c.width, c.height, c.matches, c.mean_px,
                   c.scatter_px);
}

}  // namespace

std::vector<ResidualCell> residual_field(std::span<const RawMatch> matches,
                                         const RigCalibration& rig, std::uint64_t from,
                                         std::uint64_t before) {
  std::vector<ResidualCell> cells;
  for (int k = 1; k < rig.cameras; ++k) {
    Field field(rig, k);
    for (const RawMatch& m : matches)
      if (m.camera == k && m.frame >= from && m.frame < before) field.add(m);
    field.append_to(&cells);
  }
  return cells;
}

std::string format_residuals(const std::vector<ResidualCell>& begin,
                             const std::vector<ResidualCell>& end) {
  std::string text =
      "calibration,camera,left_px,top_px,width_px,height_px,matches,mean_px,scatter_px\n";
  append_rows("begin", begin, &text);
  append_rows("end", end, &text);
  return text;
}

}  // namespace vergence::app
