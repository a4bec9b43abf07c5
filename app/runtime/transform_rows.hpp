#pragma once
#include <array>
#include <span>

#include "core/math/se3.hpp"

namespace vergence::app {

/// Rows of [R t], t in m, as files and messages have a transform.
[[nodiscard]] inline std::array<double, 12> rows_of(const Transform& T) noexcept {
  std::array<double, 12> rows{};
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(rows.data()) << T.R, T.t;
  return rows;
}

/// Transform of these rows. Precondition: at least 12 numbers; further ones are ignored.
[[nodiscard]] inline Transform transform_of(std::span<const double> rows) noexcept {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(rows.data());
  return {m.leftCols<3>(), m.col(3)};
}

}  // namespace vergence::app
