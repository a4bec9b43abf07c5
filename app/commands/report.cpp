#include <iostream>

#include "app/commands/commands.hpp"
#include "app/report/report.hpp"

namespace vergence::app {
namespace {

void make_report(const std::string& session) {
  const ReportOutcome outcome = write_report(session);
  for (const std::string& message : outcome.missing) std::cerr << "vergence: " << message << '\n';
  std::cerr << report::spaced(outcome.assessment.grade) << ": " << outcome.assessment.message
            << '\n';
  std::cout << outcome.page.string() << '\n';
}

}  // namespace

void add_report(CLI::App& root, ExitCode* exit_code) {
  const auto session = std::make_shared<std::string>();
  CLI::App* command = root.add_subcommand("report", "Regenerate report.html of a session");
  command->add_option("SESSION", *session, "Session directory")->required()->type_name("DIR");
  command->footer(
      "Example: vergence report sessions/monday\nExit codes: 0 success; 2 bad arguments or input.");
  command->callback([session, exit_code] {
    make_report(*session);
    *exit_code = ExitCode::done;
  });
}

}  // namespace vergence::app
