#include "app/checkerboard/board_calibration.hpp"

#include <limits>
#include <numeric>

#include <opencv2/calib3d.hpp>

#include "app/config/calibration_checks.hpp"
#include "app/config/calibration_file.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/robust.hpp"
#include "core/math/se3.hpp"

namespace vergence::app {
namespace {

/// As CV_Error(), which would put the path of this file into the program.
[[noreturn]] void refuse(const char* why) {
  throw cv::Exception(cv::Error::StsNoConv, why, "board_calibration", "", 0);
}

// Maximum number of rounds of view rejection.
constexpr int kMaxRounds = 8;
// Number of jackknife groups. Each group costs one calibration.
constexpr std::size_t kGroups = 10;

using Points3 = std::vector<std::vector<cv::Point3f>>;
using Points2 = std::vector<std::vector<cv::Point2f>>;

/// fx fy cx cy d0 … d4.
using LensNumbers = Eigen::Matrix<double, 9, 1>;

/// When OpenCV's solvers stop.
const cv::TermCriteria kStop{cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-10};

struct Lens {
  cv::Mat K, D;

  [[nodiscard]] Lens clone() const { return {K.clone(), D.clone()}; }

  [[nodiscard]] LensNumbers numbers() const {
    LensNumbers n = LensNumbers::Zero();
    n.head<4>() << K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2);
    for (int i = 0; i < std::min<int>(5, static_cast<int>(D.total())); ++i)
      n(4 + i) = D.at<double>(i);
    return n;
  }
};

/// A calibration of some of the views.
struct Solution {
  // Indexed by camera.
  std::vector<Lens> lenses;
  // Computed from the residuals. 0 if unknown.
  std::vector<LensNumbers> lens_sigmas;
  std::vector<double> alone_rms;
  std::vector<Transform> T_camera_left;
  // Indexed by view.
  std::vector<Transform> T_left_board;
  // Indexed by view.
  std::vector<double> view_rms;
  // RMS of camera 0 with camera 1, or of a single camera.
  double rms = 0;
};

Transform transform_from(const cv::Mat& rotation, const cv::Mat& t) {
  cv::Mat R = rotation;
  if (rotation.total() == 3) cv::Rodrigues(rotation, R);
  Transform T;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T.R(i, j) = R.at<double>(i, j);
    T.t(i) = t.at<double>(i);
  }
  return T;
}

cv::Point3f object_point(const BoardPattern& board, std::size_t index) {
  const Eigen::Vector3f X = board.corner(index).cast<float>();
  return {X.x(), X.y(), X.z()};
}
cv::Point2f image_point(const BoardCorner& c) {
  return {static_cast<float>(c.pixel.x()), static_cast<float>(c.pixel.y())};
}

class BoardCalibrator {
 public:
  BoardCalibrator(const std::vector<BoardView>& views, const BoardCalibrationOptions& options)
      : views_(views), options_(options), cameras_(options.sizes.size()) {}

  [[nodiscard]] BoardCalibration run() const {
    BoardCalibration result;
    result.T_left_board.resize(views_.size());
    for (const BoardView& v : views_) result.views.push_back({v.name, 0, false});
    std::vector<std::size_t> used(views_.size());
    std::iota(used.begin(), used.end(), 0U);
    Solution s;
    try {
      // Lenses are held first: images that do not belong together would bend them.
      for (const bool hold : {true, false})
        for (int round = 0; round < kMaxRounds; ++round) {
          s = solve(used, hold, nullptr);
          std::vector<double> rms = s.view_rms;
          const double limit = std::max(kNeverRejected, kRejectedRatio * median(std::span(rms)));
          std::vector<std::size_t> kept;
          for (std::size_t i = 0; i < used.size(); ++i) {
            result.views[used[i]].rms_px = s.view_rms[i];
            if (s.view_rms[i] <= limit) kept.push_back(used[i]);
          }
          if (kept.size() == used.size()) break;
          used = std::move(kept);
        }
      RigCalibration& rig = result.rig;
      rig.cameras = static_cast<int>(cameras_);
      rig.reprojection_px = s.rms;
      rig.frames = static_cast<int>(used.size());
      for (std::size_t k = 0; k < cameras_; ++k) {
        const LensNumbers n = s.lenses[k].numbers();
        Intrinsics& lens = rig.intrinsics[k];
        lens.kind = options_.model;
        lens.width = options_.sizes[k].width, lens.height = options_.sizes[k].height;
        lens.fx = n(0), lens.fy = n(1), lens.cx = n(2), lens.cy = n(3);
        for (std::size_t i = 0; i < 5; ++i)
          lens.distortion[i] = n(static_cast<Eigen::Index>(4 + i));
        rig.T_camera_left[k] = s.T_camera_left[k];
        result.cameras[k].alone_rms_px = s.alone_rms[k];
        result.cameras[k].images = static_cast<int>(std::ranges::count_if(
            used, [&](std::size_t v) { return !views_[v].corners[k].empty(); }));
      }
      for (std::size_t i = 0; i < used.size(); ++i) {
        result.views[used[i]].used = true;
        result.T_left_board[used[i]] = s.T_left_board[i];
      }
      set_sigmas(used, s, &rig);
      if (cameras_ == 1) return result;
      rig.baseline = rig.T_camera_left[1].t.norm();
      if (const auto bad = find_implausible(&rig))
        result.error = "the views do not determine a plausible calibration: " + bad->message;
    } catch (const cv::Exception& e) {
      result.error = "the views do not determine intrinsics and extrinsics (" + e.err +
                     "); add tilted views, and check that both images of a pair are of one instant";
    }
    return result;
  }

 private:
  [[nodiscard]] Solution solve(const std::vector<std::size_t>& used, bool hold_lenses,
                               const Solution* start) const {
    Solution s;
    s.lenses.resize(cameras_);
    s.lens_sigmas.assign(cameras_, LensNumbers::Zero());
    s.alone_rms.resize(cameras_);
    s.T_camera_left.resize(cameras_);
    s.T_left_board.resize(used.size());
    s.view_rms.resize(used.size());
    for (std::size_t k = 0; k < cameras_; ++k) {
      if (start != nullptr && hold_lenses)
        s.lenses[k] = start->lenses[k].clone();
      else
        calibrate_alone(k, used, start, &s);
    }
    s.rms = s.alone_rms[0];
    for (std::size_t k = 1; k < cameras_; ++k) calibrate_pair(k, used, hold_lenses, &s);
    return s;
  }
  void calibrate_alone(std::size_t camera, const std::vector<std::size_t>& used,
                       const Solution* start, Solution* s) const {
    Points3 object;
    Points2 image;
    // Positions in `used`.
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < used.size(); ++i) {
      const BoardCorners& corners = views_[used[i]].corners[camera];
      if (corners.empty()) continue;
      at.push_back(i);
      object.emplace_back();
      image.emplace_back();
      for (const BoardCorner& c : corners) {
        object.back().push_back(object_point(options_.board, c.index));
        image.back().push_back(image_point(c));
      }
    }
    if (at.size() < (start != nullptr ? 2 : kMinViews))
      throw InputError(
          "camera {} sees the target in only {} consistent views; at least {} are needed, 15 good "
          "ones are enough",
          camera, at.size(), kMinViews);
    Lens& lens = s->lenses[camera];
    std::vector<cv::Mat> rvecs, tvecs;
    std::vector<double> errors(at.size());
    if (radtan()) {
      cv::Mat sigmas, by_view;
      if (start != nullptr) lens = start->lenses[camera].clone();
      s->alone_rms[camera] = cv::calibrateCamera(
          object, image, size(camera), lens.K, lens.D, rvecs, tvecs, sigmas, cv::noArray(), by_view,
          k3_flag() | (start != nullptr ? cv::CALIB_USE_INTRINSIC_GUESS : 0), kStop);
      for (int i = 0; i < 9; ++i) s->lens_sigmas[camera](i) = sigmas.at<double>(i);
      for (std::size_t i = 0; i < at.size(); ++i)
        errors[i] = by_view.at<double>(static_cast<int>(i));
    } else {
      s->alone_rms[camera] = calibrate_fisheye(object, image, size(camera),
                                               start == nullptr ? nullptr : &start->lenses[camera],
                                               &lens, &rvecs, &tvecs);
      for (std::size_t i = 0; i < at.size(); ++i) {
        std::vector<cv::Point2f> projected;
        cv::fisheye::projectPoints(object[i], projected, rvecs[i], tvecs[i], lens.K, lens.D);
        errors[i] = cv::norm(projected, image[i], cv::NORM_L2) /
                    std::sqrt(static_cast<double>(image[i].size()));
      }
    }
    if (!cv::checkRange(lens.K) || !cv::checkRange(lens.D))
      refuse("the intrinsics are not finite; add tilted views");
    for (std::size_t i = 0; i < at.size(); ++i) {
      s->view_rms[at[i]] = std::max(s->view_rms[at[i]], errors[i]);
      if (camera == 0) s->T_left_board[at[i]] = transform_from(rvecs[i], tvecs[i]);
    }
  }
  /// fisheye::calibrate ends in wrong minima from the focal length of another lens: the best of a
  /// few starts.
  static double calibrate_fisheye(const Points3& object, const Points2& image, const cv::Size& size,
                                  const Lens* start, Lens* lens, std::vector<cv::Mat>* rvecs,
                                  std::vector<cv::Mat>* tvecs) {
    constexpr int kFlags = cv::fisheye::CALIB_USE_INTRINSIC_GUESS |
                           cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW;
    double best = std::numeric_limits<double>::infinity();
    for (const double part : {0.3, 0.45, 0.65, 1.0, 1.5}) {
      if (start != nullptr && std::isfinite(best)) break;
      const double focal = part * size.width;
      Lens next{.K = (cv::Mat_<double>(3, 3) << focal, 0, 0.5 * (size.width - 1), 0, focal,
                      0.5 * (size.height - 1), 0, 0, 1),
                .D = cv::Mat::zeros(4, 1, CV_64F)};
      if (start != nullptr) next = start->clone();
      std::vector<cv::Mat> turns, places;
      try {
        const double rms = cv::fisheye::calibrate(object, image, size, next.K, next.D, turns,
                                                  places, kFlags, kStop);
        if (!(rms < best)) continue;
        best = rms;
        *lens = next;
        *rvecs = turns;
        *tvecs = places;
      } catch (const cv::Exception&) {
        // Another start may converge.
      }
    }
    if (!std::isfinite(best))
      refuse(
          "the fisheye model does not converge; check --model and add views near the image edges");
    return best;
  }
  /// Corners that both cameras have. Of fisheye lenses, which stereoCalibrate does not know, as a
  /// camera without distortion would see them.
  void calibrate_pair(std::size_t camera, const std::vector<std::size_t>& used, bool hold_lenses,
                      Solution* s) const {
    Points3 object;
    std::array<Points2, 2> image;
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < used.size(); ++i) {
      std::vector<cv::Point3f> common;
      std::array<std::vector<cv::Point2f>, 2> pixels;
      for (const BoardCorner& a : views_[used[i]].corners[0])
        for (const BoardCorner& b : views_[used[i]].corners[camera])
          if (a.index == b.index) {
            common.push_back(object_point(options_.board, a.index));
            pixels[0].push_back(image_point(a));
            pixels[1].push_back(image_point(b));
          }
      if (common.size() < 4) continue;
      at.push_back(i);
      object.push_back(common);
      for (std::size_t side = 0; side < 2; ++side) {
        const Lens& lens = s->lenses[side == 0 ? 0 : camera];
        if (!radtan())
          cv::fisheye::undistortPoints(pixels[side], pixels[side], lens.K, lens.D, cv::noArray(),
                                       lens.K);
        image[side].push_back(pixels[side]);
      }
    }
    if (at.size() < kMinViews)
      throw InputError(
          "cameras 0 and {} see the target together in only {} consistent views; at least {} are "
          "needed",
          camera, at.size(), kMinViews);
    const bool refine = radtan() && !hold_lenses && camera == 1;
    Lens &first = s->lenses[0], &second = s->lenses[camera];
    cv::Mat none[2], R, T, E, F, by_view;
    const double rms = cv::stereoCalibrate(
        object, image[0], image[1], first.K, radtan() ? first.D : none[0], second.K,
        radtan() ? second.D : none[1], size(0), R, T, E, F, by_view,
        refine ? cv::CALIB_USE_INTRINSIC_GUESS | k3_flag() : cv::CALIB_FIX_INTRINSIC, kStop);
    if (!std::isfinite(rms) || !cv::checkRange(R) || !cv::checkRange(T))
      refuse("the extrinsics are not finite; add views that both cameras see");
    if (camera == 1) s->rms = rms;
    s->T_camera_left[camera] = transform_from(R, T);
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto row = static_cast<int>(i);
      const double both =
          std::hypot(by_view.at<double>(row, 0), by_view.at<double>(row, 1)) / M_SQRT2;
      s->view_rms[at[i]] = std::max(s->view_rms[at[i]], both);
    }
  }
  /// Jackknife over groups of views: (G − 1)/G Σ (δ_g − mean)(δ_g − mean)ᵀ, δ_g by how much the
  /// numbers move without group g.
  void set_sigmas(const std::vector<std::size_t>& used, const Solution& s,
                  RigCalibration* rig) const {
    const std::size_t groups = std::min(kGroups, used.size());
    const auto lenses = static_cast<Eigen::Index>(9 * cameras_),
               numbers = static_cast<Eigen::Index>(15 * cameras_);
    for (const bool hold : {true, false}) {
      Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(groups), numbers);
      for (std::size_t g = 0; g < groups; ++g) {
        std::vector<std::size_t> rest;
        for (std::size_t i = 0; i < used.size(); ++i)
          if (i % groups != g) rest.push_back(used[i]);
        const Solution without = solve(rest, hold, &s);
        for (std::size_t k = 0; k < cameras_; ++k) {
          auto row = moved.row(static_cast<Eigen::Index>(g));
          const auto lens = static_cast<Eigen::Index>(9 * k),
                     place = lenses + static_cast<Eigen::Index>(6 * k);
          row.segment<9>(lens) = (without.lenses[k].numbers() - s.lenses[k].numbers()).transpose();
          const Transform &a = without.T_camera_left[k], &b = s.T_camera_left[k];
          row.segment<3>(place) = log_so3(a.R * b.R.transpose()).transpose();
          row.segment<3>(place + 3) = (a.t - b.t).transpose();
        }
      }
      const Eigen::MatrixXd centred = moved.rowwise() - moved.colwise().mean();
      const double scale = static_cast<double>(groups - 1) / static_cast<double>(groups);
      const Eigen::MatrixXd covariance = scale * centred.transpose() * centred;
      for (std::size_t k = 0; k < cameras_; ++k) {
        const auto place = lenses + static_cast<Eigen::Index>(6 * k);
        const Mat6 of_place = covariance.block<6, 6>(place, place);
        auto& sigmas = hold ? rig->sigma_noise[k] : rig->sigma_total[k];
        for (int i = 0; i < 6; ++i) sigmas[static_cast<std::size_t>(i)] = std::sqrt(of_place(i, i));
        if (hold) continue;
        // Fewer groups than numbers leave directions without any variance.
        rig->covariance_total[k] = groups > 6 ? of_place : Mat6(of_place.diagonal().asDiagonal());
        for (std::size_t i = 0; i < 9; ++i) {
          const auto at = static_cast<Eigen::Index>(9 * k + i);
          (i < 4 ? rig->intrinsics[k].sigma[i] : rig->intrinsics[k].distortion_sigma[i - 4]) =
              std::max(std::sqrt(covariance(at, at)),
                       s.lens_sigmas[k](static_cast<Eigen::Index>(i)));
        }
      }
    }
    if (cameras_ == 1) return;
    const Vec3 along = rig->T_camera_left[1].t.normalized();
    rig->baseline_sigma =
        std::sqrt(along.dot(rig->covariance_total[1].bottomRightCorner<3, 3>() * along));
  }
  [[nodiscard]] cv::Size size(std::size_t camera) const {
    return {options_.sizes[camera].width, options_.sizes[camera].height};
  }
  [[nodiscard]] bool radtan() const { return options_.model == CameraModelKind::pinhole_radtan; }
  [[nodiscard]] int k3_flag() const { return options_.sixth_order ? 0 : cv::CALIB_FIX_K3; }

  const std::vector<BoardView>& views_;
  const BoardCalibrationOptions& options_;
  std::size_t cameras_;
};

}  // namespace

BoardCalibration calibrate_boards(const std::vector<BoardView>& views,
                                  const BoardCalibrationOptions& options) {
  return BoardCalibrator(views, options).run();
}

}  // namespace vergence::app
