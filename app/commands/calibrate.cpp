#include <memory>
#include <optional>

#include "app/command_line/calibrate_options.hpp"
#include "app/commands/commands.hpp"
#include "app/datasets/sequence_format.hpp"
#include "app/session/drive_calibration.hpp"

namespace vergence::app {
namespace {

DriveCalibrationRequest sequence_request(const CalibrateOptions& a) {
  check_writable(a.out, a.force);
  DriveCalibrationRequest r;
  r.data = a.data;
  r.format = sequence_format(a.format, a.data);
  r.topics = {a.left_topic, a.right_topic, "", ""};
  check_topics(r.format, r.topics);
  r.out = a.out;
  r.calibration = a.calibration;
  r.baseline = a.baseline;
  r.configuration = a.common.configuration(std::nullopt);
  r.quiet = a.common.quiet;
  return r;
}

}  // namespace

void add_calibrate(CLI::App& root, const ProgramArguments& arguments, ExitCode* exit_code) {
  const auto a = std::make_shared<CalibrateOptions>();
  a->declare(root)->callback([a, arguments, exit_code] {
    *exit_code = a->given == CalibrateCommand::sequence ? calibrate_from_drive(sequence_request(*a))
                                                        : run_checkerboard_tool(arguments);
  });
}

}  // namespace vergence::app
