#include "app/calibration/board_calibration.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/calibration/camera_start.hpp"
#include "app/config/calibration_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr int kRounds = 8;  // of refusing: each refuses at least one view
constexpr double kOtherBoardRatio =
    10;  // of the median: images that do not belong together, before anything is adjusted
constexpr double kCappedDistance =
    0.1;  // rad, and of the board's distance: candidates farther apart all count alike

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Sigmas of a lens: views may have more in common than the noise of their corners, and then what
/// the jackknife says is the one to believe. With hardly any views it says nothing, or anything.
void set_lens_sigmas(const BoardCameraResult& camera, Intrinsics* lens) {
  for (std::size_t i = 0; i < camera.noise.size(); ++i)
    (i < 4 ? lens->sigma[i] : lens->distortion_sigma[i - 4]) =
        std::isfinite(camera.between[i]) ? std::max(camera.noise[i], camera.between[i])
                                         : camera.noise[i];
}

/// Views with indices into what was given, those in use only.
class Calibrator {
 public:
  Calibrator(const std::vector<BoardView>& views, const BoardCalibrationOptions& options)
      : given_(views), options_(options), cameras_(options.sizes.size()) {
    for (std::size_t v = 0; v < views.size(); ++v) used_.push_back(v);
    result_.views.resize(views.size());
    result_.T_left_board.resize(views.size());
    for (std::size_t v = 0; v < views.size(); ++v) result_.views[v].name = views[v].name;
  }

  [[nodiscard]] BoardCalibration run() {
    if (start_each() && start_together() && adjust()) conclude();
    return std::move(result_);
  }

 private:
  bool start_each();
  bool start_together();
  bool adjust();
  void conclude();

  bool fail(std::string error) {
    result_.error = std::move(error);
    return false;
  }
  /// Leaves out what is beyond `ratio` times the median; `rms` one a view in use. False: nothing
  /// was.
  bool refuse(const std::vector<double>& rms, double ratio) {
    const double limit = std::max(kNeverRefused, ratio * median(rms));
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      result_.views[used_[i]].rms_px = rms[i];
      if (rms[i] <= limit) kept.push_back(used_[i]);
    }
    const bool some = kept.size() < used_.size();
    used_ = std::move(kept);
    return some;
  }
  [[nodiscard]] BoardProblem problem() const {
    BoardProblem p;
    p.board = options_.board;
    p.rig = result_.rig;
    for (const std::size_t v : used_) {
      p.views.push_back(given_[v]);
      p.T_left_board.push_back(result_.T_left_board[v]);
    }
    return p;
  }
  [[nodiscard]] std::vector<double> rms_of(const BoardProblem& p) const {
    std::vector<double> rms;
    for (std::size_t v = 0; v < p.views.size(); ++v) rms.push_back(view_rms(p, v));
    return rms;
  }
  [[nodiscard]] int distortion_count() const {
    return options_.model == CameraModelKind::pinhole_radtan && options_.sixth_order ? 5 : 4;
  }

  const std::vector<BoardView>& given_;
  const BoardCalibrationOptions& options_;
  std::size_t cameras_;
  std::vector<std::size_t> used_{};
  std::array<std::vector<Transform>, kMaxCameras>
      T_camera_board_{};  // of every view given; of those the camera has
  BoardCalibration result_{};
};

bool Calibrator::start_each() {
  result_.rig.cameras = static_cast<int>(cameras_);
  for (std::size_t k = 0; k < cameras_; ++k) {
    T_camera_board_[k].resize(given_.size());
    for (int round = 0;; ++round) {
      std::vector<std::size_t> which;
      std::vector<const BoardCorners*> images;
      for (const std::size_t v : used_) {
        if (given_[v].corners[k].empty()) continue;
        which.push_back(v);
        images.push_back(&given_[v].corners[k]);
      }
      if (images.size() < kFewestViews)
        throw InputError(fmt::format(
            "camera {} has the board in {} usable views; {} are the least, 15 good ones are enough",
            k, images.size(), kFewestViews));
      const auto start = start_camera(images, options_, options_.sizes[k]);
      if (!start)
        return fail(fmt::format(
            "the lens of camera {} does not come out of these views: are some of them tilted?", k));
      result_.rig.intrinsics[k] = start->lens;
      result_.cameras[k].alone_rms_px = start->rms_all_px;
      for (std::size_t i = 0; i < which.size(); ++i)
        T_camera_board_[k][which[i]] = start->T_camera_board[i];
      const double limit = std::max(kNeverRefused, kRefusedRatio * median(start->rms_px));
      const auto before = used_.size();
      for (std::size_t i = 0; i < which.size(); ++i) {
        if (start->rms_px[i] <= limit) continue;
        result_.views[which[i]].rms_px = start->rms_px[i];
        std::erase(used_, which[i]);
      }
      if (used_.size() == before || round == kRounds) break;
    }
  }
  return true;
}

/// Of all views' T_camera_left the one that most others are near to: one pair of images that do not
/// belong together is outvoted.
bool Calibrator::start_together() {
  for (const std::size_t v : used_) result_.T_left_board[v] = T_camera_board_[0][v];
  if (cameras_ == 1) return true;
  for (std::size_t k = 1; k < cameras_; ++k) {
    std::vector<Transform> candidates;
    std::vector<double> depths;
    for (const std::size_t v : used_) {
      if (given_[v].corners[k].empty() || given_[v].corners[0].empty()) continue;
      candidates.push_back(T_camera_board_[k][v] * T_camera_board_[0][v].inverse());
      depths.push_back(T_camera_board_[0][v].t.norm());
    }
    if (candidates.size() < kFewestViews)
      throw InputError(
          fmt::format("cameras 0 and {} see the board together in {} views; {} are the least", k,
                      candidates.size(), kFewestViews));
    const double depth = median(depths);
    double best = std::numeric_limits<double>::infinity();
    for (const Transform& a : candidates) {
      double sum = 0;
      for (const Transform& b : candidates)
        sum += std::min(kCappedDistance, rotation_angle(a.R * b.R.transpose())) +
               std::min(kCappedDistance, (a.t - b.t).norm() / depth);
      if (sum < best) best = sum, result_.rig.T_camera_left[k] = a;
    }
  }
  (void)refuse(rms_of(problem()), kOtherBoardRatio);
  return true;
}

bool Calibrator::adjust() {
  const BoardParameters layout(static_cast<int>(cameras_), distortion_count());
  for (int round = 0;; ++round) {
    for (std::size_t k = 0; k < cameras_; ++k) {
      const auto has = std::count_if(used_.begin(), used_.end(),
                                     [&](std::size_t v) { return !given_[v].corners[k].empty(); });
      if (has < static_cast<std::ptrdiff_t>(kFewestViews))
        return fail(
            fmt::format("of camera {} only {} views are left that agree with each other: do the "
                        "images belong together?",
                        k, has));
    }
    BoardProblem p = problem();
    const BoardSolution s = solve_boards(&p, layout);
    if (!s.converged || !s.covariance.allFinite())
      return fail("the views do not determine lenses and places: more of them, tilted, are needed");
    result_.rig = p.rig;
    for (std::size_t i = 0; i < used_.size(); ++i)
      result_.T_left_board[used_[i]] = p.T_left_board[i];
    const auto rms = rms_of(p);
    if (round < kRounds && refuse(rms, kRefusedRatio)) continue;
    for (std::size_t i = 0; i < used_.size(); ++i)
      result_.views[used_[i]].rms_px = rms[i], result_.views[used_[i]].used = true;
    result_.corner_sigma_px = std::sqrt(s.variance_px2);
    result_.rig.reprojection_px = std::sqrt(s.squared_px2 / static_cast<double>(s.corners));
    result_.rig.frames = static_cast<int>(used_.size());
    const auto variance = [&](int i) { return std::max(0.0, s.covariance(i, i)); };
    // Jackknife: (n − 1)/n Σ (δ_v − mean)².
    const auto views = static_cast<double>(s.without.rows());
    const Eigen::MatrixXd centred = s.without.rowwise() - s.without.colwise().mean();
    const auto between = [&](const Eigen::VectorXd& direction) {
      return std::sqrt((views - 1) / views) * (centred * direction).norm();
    };
    const int n = layout.size();
    const auto unit = [n](int i) { return Eigen::VectorXd(Eigen::VectorXd::Unit(n, i)); };
    for (std::size_t k = 0; k < cameras_; ++k) {
      BoardCameraResult& camera = result_.cameras[k];
      const int lens = layout.lens(static_cast<int>(k));
      for (int i = 0; i < layout.lens_size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        camera.noise[at] = std::sqrt(variance(lens + i));
        camera.between[at] = between(unit(lens + i));
      }
      set_lens_sigmas(camera, &result_.rig.intrinsics[k]);
      if (k == 0) continue;
      const int place = layout.place(static_cast<int>(k));
      result_.rig.covariance_wide[k] = s.covariance.block<6, 6>(place, place);
      for (int i = 0; i < 6; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const int held = place - layout.places() + i;
        result_.rig.sigma_wide[k][at] = std::sqrt(variance(place + i));
        result_.rig.sigma_noise[k][at] =
            std::sqrt(std::max(0.0, s.places_given_lenses(held, held)));
        result_.between[k][at] = between(unit(place + i));
      }
    }
    if (cameras_ > 1) {
      Eigen::VectorXd along = Eigen::VectorXd::Zero(n);
      along.segment<3>(layout.place(1) + 3) = result_.rig.T_camera_left[1].t.normalized();
      result_.rig.baseline_sigma = std::sqrt(std::max(0.0, along.dot(s.covariance * along)));
      result_.length_between = between(along);
    }
    return true;
  }
}

void Calibrator::conclude() {
  RigCalibration& rig = result_.rig;
  const BoardProblem p = problem();
  for (std::size_t k = 0; k < cameras_; ++k) {
    BoardProblem one = p;  // one camera's images alone: its share of the residuals
    std::size_t corners = 0;
    double sum = 0;
    for (std::size_t v = 0; v < one.views.size(); ++v) {
      const std::size_t n = one.views[v].corners[k].size();
      if (n == 0) continue;
      for (std::size_t other = 0; other < cameras_; ++other)
        if (other != k) one.views[v].corners[other].clear();
      sum += view_rms(one, v) * view_rms(one, v) * static_cast<double>(n);
      corners += n;
      ++result_.cameras[k].images;
    }
    result_.cameras[k].rms_px = std::sqrt(sum / static_cast<double>(corners));
  }
  if (cameras_ == 1) return;
  rig.baseline = rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&rig))
    result_.error = "the result cannot be a rig: " + bad->sentence;
}

}  // namespace

BoardCalibration calibrate_boards(const std::vector<BoardView>& views,
                                  const BoardCalibrationOptions& options) {
  return Calibrator(views, options).run();
}

}  // namespace vergence::app
