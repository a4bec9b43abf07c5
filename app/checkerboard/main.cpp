// Implements the parts of `vergence calibrate` that need OpenCV. `vergence` starts it with its own
// words; users do not call it by name.
#include <iostream>

#include "app/checkerboard/calibrate_session.hpp"
#include "app/checkerboard/conversion.hpp"
#include "app/command_line/calibrate_options.hpp"

namespace vergence::app {
namespace {

BoardPattern make_board(const CalibrateOptions& a) {
  if (a.board.empty() && a.aprilgrid.empty() && a.charuco.empty())
    throw InputError(
        "the calibration target is missing; give --checkerboard 9x6 (inner corners), --aprilgrid "
        "6x6 (tags) or --charuco 11x8 (squares)");
  if (!a.aprilgrid.empty()) return parse_aprilgrid(a.aprilgrid, *a.square, a.spacing);
  if (!a.board.empty()) return parse_checkerboard(a.board, *a.square);
  if (!a.marker)
    throw InputError("--marker is missing; pass the side of a marker in metres, like 0.018");
  return parse_charuco(a.charuco, *a.square, *a.marker, a.dictionary);
}

CalibrateRequest make_request(const CalibrateOptions& a) {
  if (a.sixth_order && a.model == "equidistant")
    throw InputError("--k3 is for --model radtan; remove it, because equidistant has k1 to k4");
  const CameraModelKind model = a.model == "equidistant" ? CameraModelKind::pinhole_equidistant
                                                         : CameraModelKind::pinhole_radtan;
  const CalibrateRequest r{{make_board(a), {}, model, a.sixth_order},
                           a.out,
                           a.baseline,
                           a.keep_views,
                           a.json,
                           a.common.quiet};
  check_writable(r.out, a.force);
  return r;
}

ExitCode convert(const CalibrateOptions& a) {
  ConversionRequest r{a.in, a.out, format_of(a.to, a.out), std::nullopt, a.force};
  if (!a.size.empty()) r.size = parse_size(a.size);
  for (const std::string& message : convert_calibration(r))
    std::cerr << "vergence: " << message << '\n';
  return ExitCode::done;
}

ExitCode calibrate_target(const CalibrateOptions& a) {
  std::vector<std::vector<std::string>> patterns{a.left};
  if (!a.right.empty()) patterns.push_back(a.right);
  for (const std::string& pattern : a.more_cameras) patterns.push_back({pattern});
  if (patterns.size() > kMaxCameras)
    throw InputError("{} cameras are given, and a rig has at most {}; remove some", patterns.size(),
                     kMaxCameras);
  return calibrate_images(make_request(a), patterns);
}

ExitCode run(const CalibrateOptions& a) {
  if (a.given == CalibrateCommand::target) return calibrate_target(a);
  if (a.given == CalibrateCommand::live)
    return calibrate_live(make_request(a), a.common.configuration(a.configuration));
  if (a.given == CalibrateCommand::convert) return convert(a);
  throw InputError("calibrate sequence needs no target; 'vergence calibrate sequence' does it");
}

}  // namespace
}  // namespace vergence::app

int main(int argc, char** argv) {
  using namespace vergence::app;
  const auto declare = [](CLI::App& root, const ProgramArguments& /*words*/, ExitCode* exit_code) {
    const auto a = std::make_shared<CalibrateOptions>();
    a->declare(root)->callback([a, exit_code] { *exit_code = run(*a); });
  };
  return static_cast<int>(run_program(argc, argv, declare));
}
