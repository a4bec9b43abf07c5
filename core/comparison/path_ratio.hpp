#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/math/se3.hpp"

namespace vergence {

struct ComparisonOptions;

/// Length of our path over that of the INS, on the newest ComparisonOptions::scale_stretch_m. A
/// value; threads one.
class PathRatio {
 public:
  /// A pose, where the INS has it, and the INS's position sigma (m).
  void add(const Vec3& ours, const Vec3& ins, double position_sigma,
           const ComparisonOptions& options) noexcept;
  /// Poses or fixes are missing here: no step across.
  void interrupt() noexcept { last_.reset(); }

  /// 0: not yet that far.
  [[nodiscard]] double value() const noexcept { return ratio_; }
  /// It is not 1, beyond the tolerance and four sigmas.
  [[nodiscard]] bool disagrees() const noexcept { return disagrees_; }

 private:
  static constexpr std::size_t kSteps = 40;
  struct Step {  // along both paths, m
    double ours = 0, ins = 0;
  };
  struct Place {
    Vec3 ours, ins;
  };
  void measure(double position_sigma, const ComparisonOptions& options) noexcept;

  std::array<Step, kSteps> steps_{};
  std::uint64_t count_ = 0;
  std::optional<Place> last_;
  double ratio_ = 0;
  bool disagrees_ = false;
};

}  // namespace vergence
