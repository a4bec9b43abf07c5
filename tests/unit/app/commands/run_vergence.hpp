#pragma once
#include <sys/wait.h>

#include <cstdlib>

#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

/// Result of one run of the built program.
struct Outcome {
  /// Exit code, or 128 + the number of the signal that ended the program.
  int code = -1;
  std::string out, err;
};

/// Runs the program with arguments as a shell takes them. VERGENCE_PROGRAM is its path. `before`: a
/// shell's words in front of it ("ulimit -n 64;").
[[nodiscard]] inline Outcome run_vergence(const std::string& arguments,
                                          const std::string& before = "") {
  const TemporaryFolder folder;
  const auto out = folder / "out", err = folder / "err";
  const std::string command = before + " '" + VERGENCE_PROGRAM + "' " + arguments + " >'" +
                              out.string() + "' 2>'" + err.string() + "' </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(out),
          read_file(err)};
}

}  // namespace vergence::test
