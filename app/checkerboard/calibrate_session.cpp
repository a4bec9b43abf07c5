#include "app/checkerboard/calibrate_session.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/checkerboard/board_images.hpp"
#include "app/checkerboard/board_report.hpp"
#include "app/config/calibration_checks.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

/// Views whose boards lie differently: by 2 degrees, or 3 % of their distance. One view many times
/// over says no more than once.
std::size_t distinct_views(const BoardCalibration& found) {
  constexpr double kTurn = 2 * kRadiansPerDegree, kShift = 0.03;
  std::vector<Transform> distinct;
  for (std::size_t v = 0; v < found.views.size(); ++v) {
    const Transform& T = found.T_left_board[v];
    const bool seen = std::ranges::any_of(distinct, [&](const Transform& other) {
      return rotation_angle(T.R * other.R.transpose()) < kTurn &&
             (T.t - other.t).norm() < kShift * T.t.norm();
    });
    if (found.views[v].used && !seen) distinct.push_back(T);
  }
  return distinct.size();
}

/// Why the views say too little of the lenses: half a message; empty: they do not.
std::string undetermined(const BoardCalibration& found) {
  constexpr std::size_t kFewest = 4;
  // Maximum sigma as a fraction of the focal length.
  constexpr double kMaxSigma = 0.02;
  if (const std::size_t distinct = distinct_views(found); distinct < kFewest)
    return fmt::format(
        "only {} of {} views differ from each other; at least {} are needed, 15 are better: move "
        "and tilt the target between the images",
        distinct, found.views.size(), kFewest);
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.rig.cameras); ++k) {
    const Intrinsics& lens = found.rig.intrinsics[k];
    if (lens.sigma[0] > kMaxSigma * lens.fx)
      return fmt::format(
          "the views do not determine the intrinsics of camera {}: the focal length {:.0f} px has "
          "a sigma of {:.0f} px ({:.1f} %; at most {:.0f} % is accepted): tilt the target more, "
          "and show it nearer and farther",
          k, lens.fx, lens.sigma[0], 100 * lens.sigma[0] / lens.fx, 100 * kMaxSigma);
  }
  return "";
}

/// With k3 where that explains the corners better: every camera's k3 is far from 0, and the
/// residuals shrink.
BoardCalibration calibrate_with_k3(const std::vector<BoardView>& views,
                                   BoardCalibrationOptions options, BoardCalibration without,
                                   Progress* progress) {
  // Limits relative to the residuals without the change.
  constexpr double kSigmas = 5, kBetter = 0.97;
  if (options.sixth_order || options.model != CameraModelKind::pinhole_radtan ||
      !without.error.empty())
    return without;
  options.sixth_order = true;
  BoardCalibration with = calibrate_boards(views, options);
  if (!with.error.empty() || with.rig.reprojection_px > kBetter * without.rig.reprojection_px)
    return without;
  for (std::size_t k = 0; k < static_cast<std::size_t>(with.rig.cameras); ++k) {
    const Intrinsics& lens = with.rig.intrinsics[k];
    if (!(std::abs(lens.distortion[4]) > kSigmas * lens.distortion_sigma[4])) return without;
  }
  progress->print(fmt::format(
      "vergence: k3 is also estimated: the residuals are {:.3f} px with it and {:.3f} px without",
      with.rig.reprojection_px, without.rig.reprojection_px));
  return with;
}

}  // namespace

ExitCode conclude_calibration(const CalibrateRequest& request, const std::vector<ImageSize>& sizes,
                              CalibrationFile file, const std::vector<BoardView>& views,
                              Progress* progress) {
  BoardCalibrationOptions options = request.calibration;
  options.sizes = sizes;
  // Squares of real boards have between 2 mm and half a metre.
  if (const double square = options.board.square; square < 0.002 || square > 0.5)
    progress->print(
        fmt::format("vergence: --square is {:g} m, unusually {}; check that it is in metres, "
                    "because the baseline scales with it",
                    square, square < 0.002 ? "small" : "large"));
  const BoardCalibration found =
      calibrate_with_k3(views, options, calibrate_boards(views, options), progress);
  const std::string why = found.error.empty() ? undetermined(found) : found.error;
  if (!why.empty()) {
    progress->print("vergence: no calibration: " + why);
    return ExitCode::not_usable;
  }
  file.rig = found.rig;
  file.rig.found =
      Stamp(std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
  file.source = "checkerboard";
  write_calibration(request.out, file);
  Coverage coverage(options.board, {file.names.begin(), file.names.begin() + file.rig.cameras},
                    sizes, file.rig.intrinsics[0].fx);
  for (std::size_t v = 0; v < views.size(); ++v)
    if (found.views[v].used) coverage.add(views[v]);
  const BoardReport report{found, file, options.board, coverage, request.measured_baseline};
  std::cout << (request.json ? json_report(report).dump(1) + "\n" : format_report(report));
  if (file.rig.cameras > 1) {
    progress->print("vergence: " + baseline_message(file.rig));
    if (const std::string warning = baseline_warning(file.rig); !warning.empty())
      progress->print("vergence: " + warning);
  }
  progress->print(fmt::format("{}: written{}", request.out.string(),
                              file.rig.cameras == 1
                                  ? "; it has one camera: copy its intrinsics into a configuration "
                                    "or into a calibration.yaml of the rig"
                                  : ""));
  return ExitCode::done;
}

ExitCode calibrate_images(const CalibrateRequest& request,
                          const std::vector<std::vector<std::string>>& patterns) {
  constexpr std::array kOptions{"--left", "--right", "--camera", "--camera"};
  Progress progress = Progress::on_stderr(request.quiet);
  std::vector<std::vector<std::filesystem::path>> files;
  for (std::size_t k = 0; k < patterns.size(); ++k)
    files.push_back(matching_files(patterns[k], kOptions[k]));
  std::vector<std::string> remarks;
  const auto views = group_views(files, &remarks);
  BoardImages images =
      read_board_images(views, request.calibration.board, [&](std::size_t done, std::size_t found) {
        ProgressState state;
        state.state = "calibrate";
        state.frame = done;
        state.frames = views.size();
        state.activity = fmt::format("{} with the target", found);
        progress.update(state);
      });
  progress.finish();
  for (const std::string& message : remarks) progress.print("vergence: " + message);
  // By kind of board.
  constexpr std::array kHowToCount{"count the points where four squares meet",
                                   "at least four tags of the family 36h11 must be visible",
                                   "count squares of both colours; at least four markers must be "
                                   "visible, and --dictionary must match them"};
  // One message per view would hide the message that helps.
  if (images.views.empty())
    throw InputError(fmt::format(
        "no view shows the target with {}{}; {} ({})", request.calibration.board.describe(),
        patterns.size() > 1 ? " in two cameras" : "",
        kHowToCount.at(static_cast<std::size_t>(request.calibration.board.kind)),
        images.remarks.empty() ? "there are no images" : images.remarks.front()));
  for (const std::string& message : images.remarks) progress.print("vergence: " + message);
  return conclude_calibration(request, images.sizes, {}, images.views, &progress);
}

}  // namespace vergence::app
