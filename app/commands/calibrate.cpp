#include "app/command_line/calibrate_options.hpp"
#include "app/commands/commands.hpp"
#include "app/session/drive_calibration.hpp"

namespace vergence::app {
namespace {

ExitCode calibrate_sequence(const CalibrateOptions& a) {
  check_writable(a.out, a.force);
  ReplayRequest r{.data = a.data,
                  .format = sequence_format(a.format, a.data),
                  .topics = {a.left_topic, a.right_topic, "", ""}};
  check_topics(r.format, r.topics);
  r.calibration = a.calibration;
  r.baseline = a.baseline;
  r.configuration = a.common.configuration(std::nullopt);
  r.session.quiet = a.common.quiet;
  return calibrate_from_drive(r, a.out);
}

}  // namespace

void add_calibrate(CLI::App& root, const ProgramArguments& arguments, ExitCode* exit_code) {
  const auto a = std::make_shared<CalibrateOptions>();
  a->declare(root)->callback([a, arguments, exit_code] {
    *exit_code = a->given == CalibrateCommand::sequence ? calibrate_sequence(*a)
                                                        : run_checkerboard_tool(arguments);
  });
}

}  // namespace vergence::app
