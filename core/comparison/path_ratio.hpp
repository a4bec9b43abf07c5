#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/math/se3.hpp"

namespace vergence {

struct ComparisonOptions;

/// Ratio of the estimate's path length to that of the INS over the newest
/// ComparisonOptions::scale_stretch_m. A value; not thread-safe.
class PathRatio {
 public:
  /// Adds a pose's position, that by the INS, and the INS's standard deviation (m).
  void add(const Vec3& estimate, const Vec3& ins, double position_sigma,
           const ComparisonOptions& options) noexcept;
  /// Call if poses or fixes are missing: no step is added across the gap.
  void interrupt() noexcept { last_.reset(); }

  /// The ratio; 0 before that distance.
  [[nodiscard]] double value() const noexcept { return ratio_; }
  /// True if the ratio differs from 1 by more than the tolerance and four sigmas.
  [[nodiscard]] bool disagrees() const noexcept { return disagrees_; }

 private:
  static constexpr std::size_t kSteps = 40;
  // Lengths along both paths, in m.
  struct Step {
    double estimate = 0, ins = 0;
  };
  struct Place {
    Vec3 estimate, ins;
  };
  void measure(double position_sigma, const ComparisonOptions& options) noexcept;

  std::array<Step, kSteps> steps_{};
  std::uint64_t count_ = 0;
  std::optional<Place> last_;
  double ratio_ = 0;
  bool disagrees_ = false;
};

}  // namespace vergence
