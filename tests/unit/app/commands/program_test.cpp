#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "app/runtime/version.hpp"
#include "core/features/simd_target.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::app {
namespace {

using test::Outcome;
using test::run_vergence;

/// Refused as DESIGN §6 wants it: exit 2, nothing on stdout, one line on stderr.
testing::AssertionResult refused_in_one_sentence(const Outcome& outcome) {
  const auto lines = std::count(outcome.err.begin(), outcome.err.end(), '\n');
  if (outcome.code == 2 && outcome.out.empty() && lines == 1 && outcome.err.size() > 20)
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << "exit code " << outcome.code << ", stdout \"" << outcome.out
                                     << "\", stderr \"" << outcome.err << '"';
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Program, VersionAndHelpGoToStandardOutput) {
  const Outcome version_asked = run_vergence("--version");
  EXPECT_EQ(version_asked.code, 0);
  EXPECT_EQ(version_asked.out,
            "vergence " + std::string(version()) + ", " + features::simd_target() + "\n");
  EXPECT_EQ(version_asked.err, "");
  const Outcome help = run_vergence("--help");
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.err, "");
  for (const char* word : {"run", "replay", "evaluate", "simulate", "calibrate", "devices",
                           "doctor", "snap", "report"})
    EXPECT_TRUE(contains(help.out, std::string("\n  ") + word + " ")) << word;
}

TEST(Program, EveryCommandHasItsHelp) {
  for (const char* word : {"run", "replay", "evaluate", "simulate", "calibrate", "devices",
                           "doctor", "snap", "report"}) {
    const Outcome help = run_vergence(std::string(word) + " --help");
    EXPECT_EQ(help.code, 0) << word;
    EXPECT_TRUE(contains(help.out, std::string("vergence ") + word)) << help.out;
    EXPECT_EQ(help.err, "") << word;
  }
}

TEST(Program, HelpAndVersionAreWordsToo) {
  EXPECT_EQ(run_vergence("help").out, run_vergence("--help").out);
  EXPECT_EQ(run_vergence("help replay").out, run_vergence("replay --help").out);
  EXPECT_EQ(run_vergence("version").out, run_vergence("--version").out);
  EXPECT_TRUE(contains(run_vergence("hlep").err, "did you mean \"help\"?"));
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("help nothing")));
}

/// Every `--option` that a help text declares, one a line.
std::vector<std::string> options_of(const std::string& help) {
  std::vector<std::string> options;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    const auto at = line.find("--");
    if (!line.starts_with("  -") || at == std::string::npos) continue;
    options.push_back(line.substr(at, line.find_first_of(" ,=[", at) - at));
  }
  return options;
}

TEST(Program, ManualAndCompletionHaveEveryCommandAndOption) {
  const std::string completion = run_vergence("completion").out, whole = run_vergence("manual").out;
  std::size_t count = 0;
  for (const char* word : {"run", "replay", "evaluate", "simulate", "calibrate", "devices",
                           "doctor", "snap", "report"}) {
    const std::string page = run_vergence(std::string("manual ") + word).out;
    EXPECT_TRUE(contains(whole, std::string("\\fB") + word + "\\fR")) << word;
    const auto at = completion.find(std::string("    ") + word + ") options=");
    ASSERT_NE(at, std::string::npos) << word;
    const std::string row = completion.substr(at, completion.find('\n', at) - at);
    for (const std::string& option : options_of(run_vergence(std::string(word) + " --help").out)) {
      std::string escaped;
      for (const char c : option) escaped += c == '-' ? std::string("\\-") : std::string(1, c);
      EXPECT_TRUE(contains(page, escaped)) << word << " " << option;
      EXPECT_TRUE(contains(row, option)) << word << " " << option;
      ++count;
    }
  }
  EXPECT_GT(count, 60U);
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("manual nothing")));
}

TEST(Program, BashCompletesCommandsAndOptions) {
  const test::TemporaryFolder folder;
  folder.write("completion", run_vergence("completion").out);
  const std::string script =
      "source '" + (folder / "completion").string() +
      "'; COMP_WORDS=(vergence rep); COMP_CWORD=1; _vergence; echo \"${COMPREPLY[@]}\"; "
      "COMP_WORDS=(vergence replay x --from); COMP_CWORD=3; _vergence; echo \"${COMPREPLY[@]}\"";
  folder.write("script", script);
  const std::string command =
      "bash '" + (folder / "script").string() + "' > '" + (folder / "out").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(test::read_file(folder / "out"), "replay report\n--from-scratch\n");
}

TEST(Program, AnUnknownCommandNamesTheNearest) {
  const Outcome outcome = run_vergence("evalute a b");
  EXPECT_TRUE(refused_in_one_sentence(outcome));
  EXPECT_TRUE(contains(outcome.err, "unknown command \"evalute\"; did you mean \"evaluate\"?"))
      << outcome.err;
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("''")));
}

TEST(Program, ACommandLineThatSaysNothingIsRefused) {
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("")));
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("--loud")));
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("--")));
}

TEST(Program, AnUnknownOptionNamesTheNearest) {
  const Outcome outcome = run_vergence("--verison");
  EXPECT_TRUE(refused_in_one_sentence(outcome));
  EXPECT_TRUE(contains(outcome.err, "unknown option \"--verison\"; did you mean \"--version\"?"))
      << outcome.err;
  const Outcome of_command = run_vergence("evaluate a.tum b.tum --jsno");
  EXPECT_TRUE(refused_in_one_sentence(of_command));
  EXPECT_TRUE(
      contains(of_command.err, "evaluate: unknown option \"--jsno\"; did you mean \"--json\"?"))
      << of_command.err;
}

TEST(Program, WrongValuesOfOptionsAreOneSentence) {
  EXPECT_TRUE(refused_in_one_sentence(
      run_vergence("replay somewhere --format kitti --out out --frames many")));
  EXPECT_TRUE(refused_in_one_sentence(run_vergence("replay")));
}

TEST(Program, WordsOfTheUserCannotSteerTheTerminal) {
  const Outcome outcome = run_vergence("\"$(printf 'a\\033[2Jb\\nc')\"");
  EXPECT_TRUE(refused_in_one_sentence(outcome));
  EXPECT_FALSE(contains(outcome.err, "\033"));
}

TEST(Program, AStackThatIsTooSmallIsSaidBeforeItOverflows) {
  const test::Outcome o = test::run_vergence("--version", "ulimit -S -s 64;");
  EXPECT_EQ(o.code, 2);
  EXPECT_NE(o.err.find("the stack is limited to 64 kB, and 1024 are needed: raise the limit"),
            std::string::npos)
      << o.err;
}

TEST(Program, AStandardOutputThatTakesNothingIsAnError) {
  const std::string command =
      std::string("'") + VERGENCE_PROGRAM + "' --help >/dev/full 2>/dev/null";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 2);
}

}  // namespace
}  // namespace vergence::app
