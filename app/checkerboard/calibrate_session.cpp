#include "app/checkerboard/calibrate_session.hpp"

#include <chrono>
#include <cmath>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/calibration/board_images.hpp"
#include "app/calibration/board_report.hpp"
#include "app/config/calibration_file.hpp"

namespace vergence::app {
namespace {

constexpr double kSquarePixels = 0.03;  // fx over fy from 1
constexpr double kVagueFocal = 0.01;    // sigma over focal length

Coverage coverage_of(const CalibrateRequest& request, const CalibrationFile& file,
                     const std::vector<ImageSize>& sizes, const std::vector<BoardView>& views,
                     const BoardCalibration& found) {
  const auto cameras = static_cast<std::size_t>(file.rig.cameras);
  Coverage coverage(request.board,
                    {file.names.begin(), file.names.begin() + static_cast<std::ptrdiff_t>(cameras)},
                    sizes, file.rig.intrinsics[0].fx);
  for (std::size_t v = 0; v < views.size(); ++v)
    if (found.views[v].used) coverage.add(views[v]);
  return coverage;
}

void remark(const CalibrationFile& file, Progress* progress) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(file.rig.cameras); ++k) {
    const Intrinsics& lens = file.rig.intrinsics[k];
    if (lens.sigma[0] > kVagueFocal * lens.fx)
      progress->say(
          fmt::format("vergence: {}: the focal length is only known to {:.1f} %; tilt the board "
                      "more, and show it nearer and farther",
                      file.names[k], 100 * lens.sigma[0] / lens.fx));
    if (const double differ = std::abs(lens.fx / lens.fy - 1); differ > kSquarePixels)
      progress->say(fmt::format(
          "vergence: {}: fx and fy differ by {:.1f} %, pixels of cameras are square: look whether "
          "--board has its corners the "
          "right way round "
          "(9x6 or 6x9), whether images were stretched, and show the board tilted both ways",
          file.names[k], 100 * differ));
  }
}

const char* how_to_count(BoardKind kind) {
  switch (kind) {
    case BoardKind::aprilgrid:
      return "tags are of the family 36h11, and four have to be seen at least";
    case BoardKind::charuco:
      return "count squares of both colours; four markers have to be seen at least, and "
             "--dictionary has to be theirs";
    case BoardKind::checkerboard:
      break;
  }
  return "count them where four squares meet";
}

}  // namespace

ExitCode conclude_calibration(const CalibrateRequest& request, const CalibratedRig& rig,
                              const std::vector<BoardView>& views, Progress* progress) {
  BoardCalibrationOptions options;
  options.board = request.board;
  options.sizes = rig.sizes;
  options.model = request.model;
  options.sixth_order = request.sixth_order;
  const BoardCalibration found = calibrate_boards(views, options);
  if (!found.error.empty()) {
    progress->say("vergence: no calibration: " + found.error);
    return ExitCode::not_usable;
  }
  CalibrationFile file;
  file.rig = found.rig;
  file.rig.found = Stamp(std::chrono::duration_cast<std::chrono::nanoseconds>(
                             std::chrono::system_clock::now().time_since_epoch())
                             .count());
  file.rig_name = rig.rig_name;
  file.source = "checkerboard";
  for (std::size_t k = 0; k < rig.names.size(); ++k)
    if (!rig.names[k].empty()) file.names[k] = rig.names[k];
  for (std::size_t k = 0; k < rig.serials.size(); ++k) file.serials[k] = rig.serials[k];
  write_calibration(request.out, file);
  const Coverage coverage = coverage_of(request, file, rig.sizes, views, found);
  const BoardReport report{found, file, request.board, coverage, request.measured_baseline};
  std::cout << (request.json ? json_report(report).dump(1) + "\n" : format_report(report));
  remark(file, progress);
  progress->say(fmt::format("{}: written{}", request.out.string(),
                            file.rig.cameras == 1
                                ? "; one camera makes no rig, its intrinsics go into a "
                                  "configuration or another calibration.yaml"
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
  std::string words;
  BoardImages images =
      read_board_images(views, request.board, [&](std::size_t done, std::size_t found) {
        ProgressState state;
        state.state = "calibrate";
        state.frame = done;
        state.frames = views.size();
        words = fmt::format("{} with the board", found);
        state.words = words;
        progress.update(state);
      });
  progress.finish();
  for (const std::string& sentence : remarks) progress.say("vergence: " + sentence);
  if (images.views.empty())  // a sentence a view would only hide the one that helps
    throw InputError(
        fmt::format("no view has the board of {}{}; {} ({})", request.board.words(),
                    patterns.size() > 1 ? " in two cameras" : "", how_to_count(request.board.kind),
                    images.remarks.empty() ? "there are no images" : images.remarks.front()));
  for (const std::string& sentence : images.remarks) progress.say("vergence: " + sentence);
  CalibratedRig rig;
  rig.sizes = images.sizes;
  return conclude_calibration(request, rig, images.views, &progress);
}

}  // namespace vergence::app
