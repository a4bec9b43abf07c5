#include "app/calibration/camera_start.hpp"

#include <cmath>

#include <opencv2/calib3d.hpp>

#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

constexpr int kSteps = 200;
constexpr double kTolerance = 1e-10;

Vec3 vector_of(const cv::Mat& m) {
  const cv::Mat flat = m.reshape(1, 3);
  return {flat.at<double>(0), flat.at<double>(1), flat.at<double>(2)};
}

std::vector<cv::Point3f> object_points(const BoardPattern& board, const BoardCorners& seen) {
  std::vector<cv::Point3f> points;
  for (const BoardCorner& c : seen) {
    const Eigen::Vector3f X = board.corner(c.index).cast<float>();
    points.emplace_back(X.x(), X.y(), X.z());
  }
  return points;
}

/// OpenCV's calibrateCamera. It takes single precision; the adjustment goes on from the corners as
/// they are.
bool start_perspective(BoardProblem* alone, bool sixth_order) {
  Intrinsics& lens = alone->rig.intrinsics[0];
  std::vector<std::vector<cv::Point3f>> object;
  std::vector<std::vector<cv::Point2f>> image;
  for (const BoardView& v : alone->views) {
    object.push_back(object_points(alone->board, v.corners[0]));
    image.emplace_back();
    for (const BoardCorner& c : v.corners[0])
      image.back().emplace_back(static_cast<float>(c.pixel.x()), static_cast<float>(c.pixel.y()));
  }
  cv::Mat K, D;
  std::vector<cv::Mat> turns, places;
  cv::calibrateCamera(object, image, {lens.width, lens.height}, K, D, turns, places,
                      sixth_order ? 0 : cv::CALIB_FIX_K3,
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kSteps, kTolerance});
  if (!cv::checkRange(K) || !cv::checkRange(D)) return false;
  lens.fx = K.at<double>(0, 0), lens.fy = K.at<double>(1, 1), lens.cx = K.at<double>(0, 2),
  lens.cy = K.at<double>(1, 2);
  for (std::size_t i = 0; i < (sixth_order ? 5U : 4U); ++i)
    lens.distortion[i] = D.at<double>(static_cast<int>(i));
  for (std::size_t v = 0; v < alone->views.size(); ++v)
    alone->T_left_board[v] = {exp_so3(vector_of(turns[v])), vector_of(places[v])};
  return true;
}

/// A fisheye lens without distortion and with this focal length: board poses by OpenCV's solvePnP
/// from its rays.
bool start_equidistant(BoardProblem* alone, double focal) {
  constexpr double kWidest = 1.4;  // rad: a ray farther from the axis has no place on a plane
  Intrinsics& lens = alone->rig.intrinsics[0];
  lens.fx = lens.fy = focal;
  lens.cx = 0.5 * (lens.width - 1), lens.cy = 0.5 * (lens.height - 1);
  lens.distortion.fill(0);
  for (std::size_t v = 0; v < alone->views.size(); ++v) {
    std::vector<cv::Point2d> rays;
    const BoardCorners& corners = alone->views[v].corners[0];
    for (const BoardCorner& c : corners) {
      const Vec2 angle((c.pixel.x() - lens.cx) / focal, (c.pixel.y() - lens.cy) / focal);
      const double theta = angle.norm();
      if (theta > kWidest) return false;
      const double stretch = theta > 1e-9 ? std::tan(theta) / theta : 1;
      rays.emplace_back(stretch * angle.x(), stretch * angle.y());
    }
    cv::Mat turn, place;
    if (!cv::solvePnP(object_points(alone->board, corners), rays, cv::Mat::eye(3, 3, CV_64F),
                      cv::noArray(), turn, place))
      return false;
    alone->T_left_board[v] = {exp_so3(vector_of(turn)), vector_of(place)};
  }
  return true;
}

/// Nothing: the adjustment does not converge from there, or to numbers that do not project.
std::optional<CameraStart> adjusted(BoardProblem alone, int coefficients) {
  const BoardSolution solution = solve_boards(&alone, BoardParameters(1, coefficients));
  if (!solution.converged) return std::nullopt;
  CameraStart start;
  start.lens = alone.rig.intrinsics[0];
  start.T_camera_board = alone.T_left_board;
  for (std::size_t v = 0; v < alone.views.size(); ++v) start.rms_px.push_back(view_rms(alone, v));
  start.rms_all_px = std::sqrt(solution.squared_px2 / static_cast<double>(solution.corners));
  return start;
}

}  // namespace

std::optional<CameraStart> start_camera(const std::vector<const BoardCorners*>& images,
                                        const BoardCalibrationOptions& options, ImageSize size) {
  BoardProblem alone;
  alone.board = options.board;
  alone.rig.cameras = 1;
  alone.rig.intrinsics[0].kind = options.model;
  alone.rig.intrinsics[0].width = size.width;
  alone.rig.intrinsics[0].height = size.height;
  for (const auto* corners : images) alone.views.emplace_back().corners[0] = *corners;
  alone.T_left_board.resize(images.size());
  try {
    if (options.model == CameraModelKind::pinhole_radtan)
      return start_perspective(&alone, options.sixth_order)
                 ? adjusted(std::move(alone), options.sixth_order ? 5 : 4)
                 : std::nullopt;
    // From the focal length of another lens the adjustment may end elsewhere: the best of a few
    // starts.
    std::optional<CameraStart> best;
    for (const double part : {0.3, 0.45, 0.65, 1.0, 1.5}) {
      if (!start_equidistant(&alone, part * size.width)) continue;
      auto next = adjusted(alone, 4);
      if (next && (!best || next->rms_all_px < best->rms_all_px)) best = std::move(next);
    }
    return best;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

}  // namespace vergence::app
