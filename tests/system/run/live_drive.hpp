#pragma once

#include "tests/support/child_program.hpp"
#include "tests/support/within.hpp"
#include "tests/system/run/session.hpp"

namespace vergence::test {

/// The program on a drive of the mock in real time, as the leader of a session of its own: with a
/// terminal, or with none.
class Drive : public ChildProgram {
 public:
  /// `errors`: a descriptor that is its standard error; −1: the terminal, or the test's.
  Drive(const std::filesystem::path& session, bool terminal, int seconds,
        const std::vector<std::string>& more = {"--quiet"}, int errors = -1)
      : ChildProgram(words(session, seconds, more), {terminal, !terminal, errors}) {}

 private:
  static std::vector<std::string> words(const std::filesystem::path& session, int seconds,
                                        const std::vector<std::string>& more) {
    std::vector<std::string> words{
        "run",        std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml",
        "--duration", std::to_string(seconds),
        "--out",      session.string(),
        "--record",   "poses",
        "--set",      "cameras.0.size=[320,240]",
        "--set",      "cameras.1.size=[320,240]",
        "--set",      "mock.texture_detail=0"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

}  // namespace vergence::test
