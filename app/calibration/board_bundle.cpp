#include "app/calibration/board_bundle.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "core/camera/camera.hpp"
#include "core/math/se3.hpp"

namespace vergence::app {
namespace {

constexpr int kMostSteps = 200;
constexpr double kFirstDamping = 1e-4, kLeastDamping = 1e-12, kMostDamping = 1e12;
constexpr double kSmallGain = 1e-11;  // relative decrease of the sum: the last step was below 1e-4
                                      // sigma, for any number of corners here

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Side = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// Normal equations of one view: s the rig's numbers, p the board's pose.
struct ViewNormal {
  Matrix ss;
  Side sp;
  Mat6 pp;
  Vector s;
  Vec6 p;
};

/// Sum of squares; infinite where a corner does not project.
double squared_sum(const BoardProblem& b, const std::array<Camera, kMaxCameras>& cameras,
                   std::size_t v) {
  double sum = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(b.rig.cameras); ++k) {
    const auto& corners = b.views[v].corners[k];
    const Transform T = b.rig.T_camera_left[k] * b.T_left_board[v];
    for (const BoardCorner& c : corners) {
      Vec2 x;
      if (cameras[k].project(T * b.board.corner(c.index), &x, nullptr) != ProjectStatus::ok)
        return std::numeric_limits<double>::infinity();
      sum += (x - c.pixel).squaredNorm();
    }
  }
  return sum;
}

std::array<Camera, kMaxCameras> lenses(const RigCalibration& rig) {
  std::array<Camera, kMaxCameras> cameras;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    cameras[k] = Camera(rig.intrinsics[k]);
  return cameras;
}

double total(const BoardProblem& b) {
  const auto cameras = lenses(b.rig);
  double sum = 0;
  for (std::size_t v = 0; v < b.views.size(); ++v) sum += squared_sum(b, cameras, v);
  return sum;
}

/// r = x − corner;  X_k = R_k X_left + t_k:  ∂X_k/∂(φ_k, τ_k) = (−[R_k X_left]×, I),  ∂X_k/∂(φ_b,
/// τ_b) = R_k (−[R_b X]×, I).
ViewNormal linearise(const BoardProblem& b, const BoardParameters& layout,
                     const std::array<Camera, kMaxCameras>& cameras, std::size_t v) {
  const int n = layout.size(), lens = layout.lens_size();
  ViewNormal normal{Matrix::Zero(n, n), Side::Zero(n, 6), Mat6::Zero(), Vector::Zero(n),
                    Vec6::Zero()};
  const Transform& T_b = b.T_left_board[v];
  for (int k = 0; k < layout.cameras(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const auto& corners = b.views[v].corners[at];
    const Transform& T_k = b.rig.T_camera_left[at];
    const int width = lens + (k > 0 ? 6 : 0);
    Matrix J(2, width);
    Matrix ss = Matrix::Zero(width, width);
    Side sp = Side::Zero(width, 6);
    Vector s = Vector::Zero(width);
    for (const BoardCorner& c : corners) {
      const Vec3 in_board = T_b.R * b.board.corner(c.index), X_left = in_board + T_b.t,
                 turned = T_k.R * X_left, X = turned + T_k.t;
      Vec2 x;
      Mat23 J_point;
      if (cameras[at].project(X, &x, &J_point) != ProjectStatus::ok)
        continue;  // the sum is infinite there, so no step leads here
      J.leftCols(lens) = cameras[at].intrinsics_jacobian(X).leftCols(lens);
      if (k > 0) {
        J.middleCols<3>(lens) = -J_point * skew(turned);
        J.middleCols<3>(lens + 3) = J_point;
      }
      Mat26 J_pose;
      J_pose << -J_point * T_k.R * skew(in_board), J_point * T_k.R;
      const Vec2 r = x - c.pixel;
      ss.noalias() += J.transpose() * J;
      sp.noalias() += J.transpose() * J_pose;
      s.noalias() += J.transpose() * r;
      normal.pp.noalias() += J_pose.transpose() * J_pose;
      normal.p.noalias() += J_pose.transpose() * r;
    }
    const auto put = [&](int from, int to, int count) {
      normal.ss.block(to, to, count, count) += ss.block(from, from, count, count);
      normal.sp.middleRows(to, count) += sp.middleRows(from, count);
      normal.s.segment(to, count) += s.segment(from, count);
    };
    put(0, layout.lens(k), lens);
    if (k == 0) continue;
    put(lens, layout.place(k), 6);
    normal.ss.block(layout.lens(k), layout.place(k), lens, 6) += ss.block(0, lens, lens, 6);
    normal.ss.block(layout.place(k), layout.lens(k), 6, lens) += ss.block(lens, 0, 6, lens);
  }
  return normal;
}

void move(const BoardParameters& layout, const Vector& step, RigCalibration* rig) {
  for (int k = 0; k < layout.cameras(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    Intrinsics& lens = rig->intrinsics[at];
    const int from = layout.lens(k);
    lens.fx += step(from), lens.fy += step(from + 1), lens.cx += step(from + 2),
        lens.cy += step(from + 3);
    for (int i = 4; i < layout.lens_size(); ++i)
      lens.distortion[static_cast<std::size_t>(i - 4)] += step(from + i);
    if (k > 0) {
      Transform& T = rig->T_camera_left[at];
      T = perturbed(T, step.segment<3>(layout.place(k)), step.segment<3>(layout.place(k) + 3));
    }
  }
}

/// One damped step. False: the equations are singular.
bool try_step(const BoardProblem& b, const BoardParameters& layout,
              const std::vector<ViewNormal>& views, double damping, BoardProblem* moved) {
  const int n = layout.size();
  Matrix S = Matrix::Zero(n, n);
  Vector g = Vector::Zero(n);
  for (const ViewNormal& v : views) S += v.ss;
  S.diagonal() *= 1 + damping;
  std::vector<Eigen::LLT<Mat6>> poses;
  for (const ViewNormal& v : views) {
    Mat6 pp = v.pp;
    pp.diagonal() *= 1 + damping;
    poses.emplace_back(pp);
    if (poses.back().info() != Eigen::Success) return false;
    S -= v.sp * poses.back().solve(v.sp.transpose());
    g += v.s - v.sp * poses.back().solve(v.p);
  }
  const Eigen::LDLT<Matrix> factor(S);
  const Vector step = -factor.solve(g);
  if (!step.allFinite()) return false;
  moved->rig = b.rig;
  moved->T_left_board = b.T_left_board;
  move(layout, step, &moved->rig);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Vec6 pose = poses[v].solve(-views[v].p - views[v].sp.transpose() * step);
    moved->T_left_board[v] = perturbed(b.T_left_board[v], pose.head<3>(), pose.tail<3>());
  }
  return moved->rig.T_camera_left[0].finite();
}

std::vector<ViewNormal> linearise_all(const BoardProblem& b, const BoardParameters& layout) {
  const auto cameras = lenses(b.rig);
  std::vector<ViewNormal> views;
  views.reserve(b.views.size());
  for (std::size_t v = 0; v < b.views.size(); ++v)
    views.push_back(linearise(b, layout, cameras, v));
  return views;
}

Matrix inverse(const Matrix& m) {
  return Eigen::LDLT<Matrix>(m).solve(Matrix::Identity(m.rows(), m.cols()));
}

/// Covariances and the effect of each view, from the undamped equations at the answer.
void spread(const BoardProblem& b, const BoardParameters& layout, BoardSolution* solution) {
  const int n = layout.size();
  std::vector<Matrix> reduced;
  std::vector<Vector> gradient;
  Matrix S = Matrix::Zero(n, n);
  for (const ViewNormal& v : linearise_all(b, layout)) {
    const Eigen::LLT<Mat6> pose(v.pp);
    reduced.emplace_back(v.ss - v.sp * pose.solve(v.sp.transpose()));
    gradient.emplace_back(v.s - v.sp * pose.solve(v.p));
    S += reduced.back();
  }
  solution->covariance = solution->variance_px2 * inverse(S);
  const int places = n - layout.places();
  solution->places_given_lenses =
      solution->variance_px2 * inverse(S.bottomRightCorner(places, places));
  solution->without.resize(static_cast<Eigen::Index>(reduced.size()), n);
  for (std::size_t v = 0; v < reduced.size(); ++v)
    solution->without.row(static_cast<Eigen::Index>(v)) =
        Eigen::LDLT<Matrix>(S - reduced[v]).solve(gradient[v]).transpose();
}

}  // namespace

double view_rms(const BoardProblem& problem, std::size_t view) {
  std::size_t corners = 0;
  for (const auto& c : problem.views[view].corners) corners += c.size();
  return std::sqrt(squared_sum(problem, lenses(problem.rig), view) / static_cast<double>(corners));
}

BoardSolution solve_boards(BoardProblem* problem, const BoardParameters& parameters) {
  BoardSolution solution;
  for (const BoardView& v : problem->views)
    for (const auto& c : v.corners) solution.corners += c.size();
  double sum = total(*problem);
  if (!std::isfinite(sum)) return solution;
  double damping = kFirstDamping;
  BoardProblem moved;
  moved.board = problem->board;
  moved.views = problem->views;
  std::vector<ViewNormal> views = linearise_all(*problem, parameters);
  while (!solution.converged && solution.steps < kMostSteps && damping < kMostDamping) {
    ++solution.steps;
    const double next = try_step(*problem, parameters, views, damping, &moved)
                            ? total(moved)
                            : std::numeric_limits<double>::infinity();
    if (!(next <= sum)) {
      // A step that changes nothing but the last digit is the end, too.
      solution.converged = std::isfinite(next) && next - sum <= kSmallGain * sum;
      damping = std::max(damping, kLeastDamping) * 10;
      continue;
    }
    solution.converged = sum - next <= kSmallGain * sum;
    sum = next;
    problem->rig = moved.rig;
    problem->T_left_board = moved.T_left_board;
    views = linearise_all(*problem, parameters);
    damping = std::max(kLeastDamping, damping * 0.1);
  }
  solution.squared_px2 = sum;
  const double spare = 2.0 * static_cast<double>(solution.corners) - parameters.size() -
                       6.0 * static_cast<double>(problem->views.size());
  if (!(spare > 0)) {
    solution.converged = false;
    return solution;
  }
  solution.variance_px2 = sum / spare;
  spread(*problem, parameters, &solution);
  return solution;
}

}  // namespace vergence::app
