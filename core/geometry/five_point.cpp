#include "core/geometry/five_point.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/geometry/detail/polynomial.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/math/linear_solve.hpp"

namespace vergence {
namespace {

// Minimum ratio of the smallest to the largest pivot of the five equations.
constexpr double kMinRank = 1e-10;
// Maximum residual of the ten cubics after refinement, for ‖E‖² of order one.
constexpr double kMaxResidual = 1e-8;
// The elimination leaves errors of at most 1e-6; two steps are usual.
constexpr int kPolishSteps = 4;

using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat10x20 = Eigen::Matrix<double, 10, 20>;
using Vec10 = Eigen::Matrix<double, 10, 1>;
using Vec20 = Eigen::Matrix<double, 20, 1>;

// Polynomials in (x, y, z) by their coefficients. Linear: x y z 1. Quadratic: x² xy xz x y² yz y z²
// z 1. Cubic, in the order of the elimination: x³ y³ x²y xy² x²z x² y²z y² xyz xy | xz² xz x yz² yz
// y z³ z² z 1.
using Linear = std::array<double, 4>;
using Quadratic = std::array<double, 10>;

struct Exponents {
  int x, y, z;
  constexpr bool operator==(const Exponents&) const = default;
};
constexpr std::array<Exponents, 4> kLinear = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
constexpr std::array<Exponents, 10> kQuadratic = {{{2, 0, 0},
                                                   {1, 1, 0},
                                                   {1, 0, 1},
                                                   {1, 0, 0},
                                                   {0, 2, 0},
                                                   {0, 1, 1},
                                                   {0, 1, 0},
                                                   {0, 0, 2},
                                                   {0, 0, 1},
                                                   {0, 0, 0}}};
constexpr std::array<Exponents, 20> kCubic = {
    {{3, 0, 0}, {0, 3, 0}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}, {2, 0, 0}, {0, 2, 1},
     {0, 2, 0}, {1, 1, 1}, {1, 1, 0}, {1, 0, 2}, {1, 0, 1}, {1, 0, 0}, {0, 1, 2},
     {0, 1, 1}, {0, 1, 0}, {0, 0, 3}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};

/// Index in C of the product of monomial i of A and j of B.
template <std::size_t A, std::size_t B, std::size_t C>
consteval std::array<std::array<std::size_t, B>, A> product_table(
    const std::array<Exponents, A>& a, const std::array<Exponents, B>& b,
    const std::array<Exponents, C>& c) {
  std::array<std::array<std::size_t, B>, A> table{};
  for (std::size_t i = 0; i < A; ++i)
    for (std::size_t j = 0; j < B; ++j) {
      const Exponents e{a[i].x + b[j].x, a[i].y + b[j].y, a[i].z + b[j].z};
      for (std::size_t k = 0; k < C; ++k)
        if (c[k] == e) table[i][j] = k;
    }
  return table;
}
constexpr auto kLinearLinear = product_table(kLinear, kLinear, kQuadratic);
constexpr auto kQuadraticLinear = product_table(kQuadratic, kLinear, kCubic);

void add_product(const Linear& a, const Linear& b, double s, Quadratic* out) noexcept {
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) (*out)[kLinearLinear[i][j]] += s * a[i] * b[j];
}

void add_product(const Quadratic& a, const Linear& b, Mat10x20* M, int row) noexcept {
  for (std::size_t i = 0; i < 10; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      (*M)(row, static_cast<int>(kQuadraticLinear[i][j])) += a[i] * b[j];
}

// X Y Z W.
using Basis = std::array<Mat3, 4>;

/// The ten cubics, one per row: det E, and the nine of E Eᵀ E − ½ tr(E Eᵀ) E.
[[nodiscard]] Mat10x20 constraints(const Basis& basis) noexcept {
  std::array<std::array<Linear, 3>, 3> E;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 4; ++k)
        E[r][c][k] = basis[k](static_cast<int>(r), static_cast<int>(c));
  Mat10x20 M = Mat10x20::Zero();
  // Expand along the first row.
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t a = (c + 1) % 3, b = (c + 2) % 3;
    Quadratic minor{};
    add_product(E[1][a], E[2][b], 1.0, &minor);
    add_product(E[1][b], E[2][a], -1.0, &minor);
    add_product(minor, E[0][c], &M, 0);
  }
  std::array<std::array<Quadratic, 3>, 3> EEt{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = r; c < 3; ++c) {
      for (std::size_t k = 0; k < 3; ++k) add_product(E[r][k], E[c][k], 1.0, &EEt[r][c]);
      EEt[c][r] = EEt[r][c];
    }
  Quadratic half_trace;
  for (std::size_t i = 0; i < 10; ++i)
    half_trace[i] = 0.5 * (EEt[0][0][i] + EEt[1][1][i] + EEt[2][2][i]);
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t i = 0; i < 10; ++i) EEt[r][r][i] -= half_trace[i];
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k)
        add_product(EEt[r][k], E[k][c], &M, static_cast<int>(1 + 3 * r + c));
  return M;
}

/// Null space of the five equations as four matrices, orthonormal.
[[nodiscard]] bool null_space(const std::array<Vec2, 5>& left, const std::array<Vec2, 5>& right,
                              Basis* basis) noexcept {
  // The columns are the equations.
  Eigen::Matrix<double, 9, 5> A;
  for (int i = 0; i < 5; ++i) {
    const Vec3 x = left[static_cast<std::size_t>(i)].homogeneous(),
               y = right[static_cast<std::size_t>(i)].homogeneous();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) A(3 * r + c, i) = y[r] * x[c];
    A.col(i).normalize();
  }
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 9, 5>> qr(A);
  if (!(std::abs(qr.matrixQR()(4, 4)) > kMinRank * std::abs(qr.matrixQR()(0, 0)))) return false;
  // Apply qr.householderQ() one reflector at a time; forming all of it takes the compiler seconds.
  Mat9 Q = Mat9::Identity();
  Eigen::Matrix<double, 9, 1> workspace;
  for (Eigen::Index k = 4; k >= 0; --k)
    Q.bottomRightCorner(9 - k, 9 - k)
        .applyHouseholderOnTheLeft(qr.matrixQR().col(k).tail(8 - k), qr.hCoeffs()[k],
                                   workspace.data());
  for (int k = 0; k < 4; ++k)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) (*basis)[static_cast<std::size_t>(k)](r, c) = Q(3 * r + c, 5 + k);
  return true;
}

/// Row of B(z): polynomials in z that multiply x, y and 1; lowest power first.
struct EliminatedRow {
  std::array<double, 4> x, y;
  std::array<double, 5> one;
};

/// Computes upper − z · lower for two rows of the reduced system, given its right ten columns.
[[nodiscard]] EliminatedRow eliminate(const Vec10& upper, const Vec10& lower) noexcept {
  return {{upper[2], upper[1] - lower[2], upper[0] - lower[1], -lower[0]},
          {upper[5], upper[4] - lower[5], upper[3] - lower[4], -lower[3]},
          {upper[9], upper[8] - lower[9], upper[7] - lower[8], upper[6] - lower[7], -lower[6]}};
}

template <std::size_t A, std::size_t B>
[[nodiscard]] std::array<double, A + B - 1> product(const std::array<double, A>& a,
                                                    const std::array<double, B>& b) noexcept {
  std::array<double, A + B - 1> out{};
  for (std::size_t i = 0; i < A; ++i)
    for (std::size_t j = 0; j < B; ++j) out[i + j] += a[i] * b[j];
  return out;
}

template <std::size_t N>
[[nodiscard]] std::array<double, N> difference(std::array<double, N> a,
                                               const std::array<double, N>& b) noexcept {
  for (std::size_t i = 0; i < N; ++i) a[i] -= b[i];
  return a;
}

template <std::size_t N>
[[nodiscard]] double value(const std::array<double, N>& p, double z) noexcept {
  double v = p[N - 1];
  for (std::size_t i = N - 1; i-- > 0;) v = v * z + p[i];
  return v;
}

/// Computes det B(z), of degree ten.
[[nodiscard]] std::array<double, 11> determinant(const std::array<EliminatedRow, 3>& B) noexcept {
  const auto p1 = difference(product(B[1].y, B[2].one), product(B[1].one, B[2].y));
  const auto p2 = difference(product(B[1].one, B[2].x), product(B[1].x, B[2].one));
  const auto p3 = difference(product(B[1].x, B[2].y), product(B[1].y, B[2].x));
  const auto a = product(B[0].x, p1), b = product(B[0].y, p2), c = product(B[0].one, p3);
  std::array<double, 11> out;
  for (std::size_t i = 0; i < 11; ++i) out[i] = a[i] + b[i] + c[i];
  return out;
}

/// Computes (x, y) with B(z) (x, y, 1)ᵀ = 0 by the longest cross product of two rows.
[[nodiscard]] bool x_and_y(const std::array<EliminatedRow, 3>& B, double z, Vec3* xyz) noexcept {
  std::array<Vec3, 3> rows;
  for (std::size_t r = 0; r < 3; ++r)
    rows[r] = Vec3(value(B[r].x, z), value(B[r].y, z), value(B[r].one, z)).normalized();
  const std::array<Vec3, 3> crosses = {rows[0].cross(rows[1]), rows[0].cross(rows[2]),
                                       rows[1].cross(rows[2])};
  const Vec3& v = *std::max_element(
      crosses.begin(), crosses.end(),
      [](const Vec3& a, const Vec3& b) noexcept { return a.squaredNorm() < b.squaredNorm(); });
  *xyz = Vec3(v.x() / v.z(), v.y() / v.z(), z);
  return xyz->allFinite();
}

/// Evaluates the ten cubics at E.
void cubics_at(const Mat3& E, Vec10* f) noexcept {
  const Mat3 EEt = E * E.transpose();
  const Mat3 T = EEt * E - 0.5 * EEt.trace() * E;
  (*f)[0] = E.determinant();
  for (int i = 0; i < 9; ++i) (*f)[1 + i] = T(i / 3, i % 3);
}

/// Gauss–Newton on the ten cubics over the unit sphere of the null space: E = Σ q_k basis_k, |q| =
/// 1.
[[nodiscard]] bool polish(const Basis& basis, const Vec3& xyz, Mat3* E_out) noexcept {
  Vec4 q(xyz.x(), xyz.y(), xyz.z(), 1.0);
  q.normalize();
  const auto matrix = [&basis](const Vec4& c) noexcept {
    return Mat3(c[0] * basis[0] + c[1] * basis[1] + c[2] * basis[2] + c[3] * basis[3]);
  };
  Mat3 E = matrix(q);
  Vec10 f;
  cubics_at(E, &f);
  for (int step = 0; step < kPolishSteps; ++step) {
    const Mat3 EEt = E * E.transpose();
    Mat3 cofactors;
    cofactors << E.row(1).cross(E.row(2)), E.row(2).cross(E.row(0)), E.row(0).cross(E.row(1));
    Eigen::Matrix<double, 10, 4> J;
    for (int k = 0; k < 4; ++k) {
      const Mat3& D = basis[static_cast<std::size_t>(k)];
      const Mat3 DEt = D * E.transpose();
      const Mat3 dT =
          (DEt + DEt.transpose()) * E + EEt * D - DEt.trace() * E - 0.5 * EEt.trace() * D;
      J(0, k) = cofactors.cwiseProduct(D).sum();
      for (int i = 0; i < 9; ++i) J(1 + i, k) = dT(i / 3, i % 3);
    }
    Eigen::Matrix4d H = J.transpose() * J;
    // The cubics do not determine the length of q; fix it, so that H has full rank.
    H.noalias() += q * q.transpose();
    const Eigen::LDLT<Eigen::Matrix4d> ldlt(H);
    const Vec4 next = (q - ldlt.solve(Vec4(J.transpose() * f))).normalized();
    const Mat3 E_next = matrix(next);
    Vec10 f_next;
    cubics_at(E_next, &f_next);
    if (!(f_next.squaredNorm() < f.squaredNorm())) break;
    q = next;
    E = E_next;
    f = f_next;
  }
  if (!(f.cwiseAbs().maxCoeff() < kMaxResidual)) return false;
  *E_out = std::sqrt(2.0) * E;
  return true;
}

}  // namespace

FivePointSolutions solve_five_point(const std::array<Vec2, 5>& left,
                                    const std::array<Vec2, 5>& right) noexcept {
  FivePointSolutions out;
  for (std::size_t i = 0; i < 5; ++i)
    if (!left[i].allFinite() || !right[i].allFinite()) return out;
  Basis basis;
  if (!null_space(left, right, &basis)) return out;
  const Mat10x20 M = constraints(basis);
  const Eigen::Matrix<double, 10, 10> head = M.leftCols<10>(), tail = M.rightCols<10>();
  const Eigen::PartialPivLU<Eigen::Matrix<double, 10, 10>> lu(head);
  const Eigen::Matrix<double, 10, 10> reduced = lu.solve(tail);
  if (!reduced.allFinite()) return out;
  const auto row = [&reduced](int i) noexcept { return Vec10(reduced.row(i).transpose()); };
  // Rows 4 … 9 of the reduced system start with x²z x² y²z y² xyz xy: pairs that differ by a factor
  // z.
  const std::array<EliminatedRow, 3> B = {eliminate(row(4), row(5)), eliminate(row(6), row(7)),
                                          eliminate(row(8), row(9))};
  std::array<double, 11> det = determinant(B);
  double largest = 0;
  for (const double c : det) largest = std::max(largest, std::abs(c));
  if (!(largest > 0) || !std::isfinite(largest)) return out;
  for (double& c : det) c /= largest;

  // Roots with |z| ≤ 1, then larger ones by the reversed polynomial in 1/z.
  std::array<double, 11> reversed = det;
  std::reverse(reversed.begin(), reversed.end());
  for (const bool outside : {false, true}) {
    std::array<double, 10> roots;
    const std::size_t n = detail::roots_in_unit_interval<10>(outside ? reversed : det, &roots);
    for (std::size_t i = 0; i < n && out.count < 10; ++i) {
      if (outside && roots[i] == 0.0) continue;
      Vec3 xyz;
      Mat3 E;
      if (!x_and_y(B, outside ? 1.0 / roots[i] : roots[i], &xyz) || !polish(basis, xyz, &E))
        continue;
      // Two starts may converge to the same solution.
      bool seen = false;
      for (int j = 0; j < out.count; ++j) {
        const Mat3& other = out.E[static_cast<std::size_t>(j)];
        seen = seen || std::min((other - E).squaredNorm(), (other + E).squaredNorm()) < 1e-18;
      }
      if (!seen) out.E[static_cast<std::size_t>(out.count++)] = E;
    }
  }
  return out;
}

int decompose_essential(const Mat3& E, std::span<const Vec2> left, std::span<const Vec2> right,
                        double baseline, Transform* T_right_left) noexcept {
  if (!E.allFinite() || left.size() != right.size()) return 0;
  auto [U, V, singular] = svd(E);
  if (U.determinant() < 0) U = -U;
  if (V.determinant() < 0) V = -V;
  Mat3 W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const std::array<Mat3, 2> rotations = {U * W * V.transpose(), U * W.transpose() * V.transpose()};
  const Vec3 t = U.col(2);
  int most_in_front = 0;
  for (const Mat3& R : rotations) {
    // The opposite t reverses the signs of both depths.
    int ahead = 0, reversed = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      double l = 0, r = 0;
      if (!match_depths({R, t}, left[i], right[i], &l, &r)) continue;
      ahead += l > 0 && r > 0 ? 1 : 0;
      reversed += l < 0 && r < 0 ? 1 : 0;
    }
    if (ahead > most_in_front) *T_right_left = {normalised(R), baseline * t}, most_in_front = ahead;
    if (reversed > most_in_front)
      *T_right_left = {normalised(R), -baseline * t}, most_in_front = reversed;
  }
  return most_in_front;
}

}  // namespace vergence
