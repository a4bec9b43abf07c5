#include "app/command_line/checkerboard_tool.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace vergence::app {

namespace fs = std::filesystem;

std::optional<fs::path> find_checkerboard_tool(const fs::path& folder) {
  for (const fs::path& place :
       {folder / kCheckerboardTool, folder.parent_path() / "libexec/vergence" / kCheckerboardTool})
    if (::access(place.c_str(), X_OK) == 0) return place;
  return std::nullopt;
}

ExitCode run_checkerboard_tool(const ProgramWords& words) {
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  const auto tool = find_checkerboard_tool(folder);
  if (!tool)
    throw InputError(fmt::format(
        "calibrate: this needs {0}, which is not installed (looked beside the program in {1}, and "
        "in {2}); install the package "
        "{0}, or build "
        "it: scripts/setup",
        kCheckerboardTool, folder.string(), (folder.parent_path() / "libexec/vergence").string()));
  std::vector<char*> argv;
  for (const char* word : words) argv.push_back(const_cast<char*>(word));  // execv() only reads
  argv.push_back(nullptr);
  std::cout.flush();
  ::execv(tool->c_str(), argv.data());
  throw InputError(fmt::format("{}: cannot be started: {}", tool->string(), std::strerror(errno)));
}

}  // namespace vergence::app
