#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/datasets/session_export.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/progress.hpp"

namespace vergence::app {
namespace {

constexpr std::array<std::pair<const char*, ExportFormat>, 3> kFormats{
    {{"folder", ExportFormat::folder},
     {"euroc", ExportFormat::euroc},
     {"kitti", ExportFormat::kitti}}};

struct ExportArguments {
  std::string session, format, out;
  std::optional<std::string> calibration;
  bool quiet = false;
};

/// Returns the ground truth of a simulated run, else the reference of the comparison.
Trajectory load_truth(const std::filesystem::path& session) {
  std::error_code ignored;
  for (const char* name : {"truth.tum", "reference.tum"})
    if (std::filesystem::exists(session / name, ignored)) return read_tum(session / name);
  return {};
}

ExitCode run_export(const ExportArguments& a) {
  const RecordedSession session = RecordedSession::open(a.session);
  ExportRequest request;
  for (const auto& [word, format] : kFormats)
    if (a.format == word) request.format = format;
  request.out = a.out;
  request.calibration = a.calibration
                            ? read_calibration(*a.calibration)
                            : parse_calibration(session.description().calibration, a.session);
  request.truth = load_truth(a.session);
  (void)check_session_folder(request.out);
  Progress progress = Progress::on_stderr(a.quiet);
  const ExportResult result = export_session(session, std::move(request), [&](std::size_t done) {
    progress.update({.state = "export",
                     .frame = done,
                     .frames = session.frames().size(),
                     .activity = "PNG images"});
  });
  progress.finish();
  for (const std::string& message : result.remarks) progress.print("vergence: " + message);
  if (result.left_out > 0)
    progress.print("vergence: {} frames without both images were left out", result.left_out);
  if (!a.quiet)
    progress.print("{}: {} frames; next: vergence replay {} --format {} --out DIR", a.out,
                   result.frames, a.out, a.format);
  return ExitCode::done;
}

}  // namespace

void add_export(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<ExportArguments>();
  CLI::App* command =
      root.add_subcommand("export", "Export a recorded session as EuRoC, KITTI or image folder");
  add_option(*command, "SESSION", a->session,
             "Session directory with drive.mcap (docs/session_files.md)", "DIR")
      ->required();
  add_option(*command, "--format", a->format, "Format: euroc, kitti (rectified rigs only), folder",
             "NAME")
      ->required()
      ->check(one_of({"euroc", "kitti", "folder"}));
  add_option(*command, "--out", a->out, "Directory; must not exist, or be empty", "DIR")
      ->required();
  add_option(*command, "--calibration", a->calibration,
             "Calibration to export (default: the initial one)", "FILE");
  command->add_flag("--quiet", a->quiet, "Print only warnings and errors");
  command->footer(
      "Example: vergence export sessions/monday --format euroc --out monday-euroc\n"
      "Exit codes: 0 success; 2 bad arguments or input.");
  command->callback([a, exit_code] { *exit_code = run_export(*a); });
}

}  // namespace vergence::app
