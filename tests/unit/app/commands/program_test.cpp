#include <algorithm>

#include "app/runtime/nearest.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::app {
namespace {

using test::contains;

using test::Outcome;
using test::run_vergence;

/// Checks a refusal: exit 2, nothing on stdout, one line on stderr.
testing::AssertionResult refused_in_one_message(const Outcome& outcome) {
  const auto lines = std::count(outcome.err.begin(), outcome.err.end(), '\n');
  if (outcome.code == 2 && outcome.out.empty() && lines == 1 && outcome.err.size() > 20)
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << "exit code " << outcome.code << ", stdout \"" << outcome.out
                                     << "\", stderr \"" << outcome.err << '"';
}

TEST(Program, renamedWordsAreRefusedWithTheirNewName) {
  using Kind = Renamed::Kind;
  const test::TemporaryFolder folder;
  folder.write("rig.yaml", "threads: 1\n");
  const std::string out = " --out '" + (folder / "out").string() + "'",
                    run = "run '" + (folder / "rig.yaml").string() + "'" + out + " --set ";
  for (const Renamed& row : renamed()) {
    const std::string name(row.name);
    const std::string words = row.kind == Kind::key ? run + name + "=1"
                              : row.kind == Kind::value
                                  ? run + std::string(name).replace(name.find(' '), 1, "=")
                                  : name + " x" + out;
    const Outcome outcome = run_vergence(words);
    EXPECT_TRUE(refused_in_one_message(outcome)) << name;
    EXPECT_TRUE(contains(outcome.err, std::string(row.now))) << name << ": " << outcome.err;
  }
}

TEST(Program, unknownCommandNamesNearest) {
  const Outcome outcome = run_vergence("evalute a b");
  EXPECT_TRUE(refused_in_one_message(outcome));
  EXPECT_TRUE(mentions(outcome.err, "unknown command \"evalute\"; did you mean \"evaluate\"?"));
  EXPECT_TRUE(refused_in_one_message(run_vergence("''")));
}

TEST(Program, controlCodesOfArgumentsAreRemoved) {
  const Outcome outcome = run_vergence("\"$(printf 'a\\033[2Jb\\nc')\"");
  EXPECT_TRUE(refused_in_one_message(outcome));
  EXPECT_FALSE(contains(outcome.err, "\033"));
}

TEST(Program, smallStackIsReportedBeforeOverflow) {
  const test::Outcome o = test::run_vergence("--version", "ulimit -S -s 64;");
  EXPECT_EQ(o.code, 2);
  EXPECT_TRUE(
      test::mentions(o.err, "the stack is limited to 64 kB, and 1024 are needed: raise the limit"));
}

TEST(Program, unwritableStandardOutputIsAnError) {
  constexpr const char* kCommand = "'" VERGENCE_PROGRAM "' --help >/dev/full 2>/dev/null";
  EXPECT_EQ(WEXITSTATUS(std::system(kCommand)), 2);
}

}  // namespace
}  // namespace vergence::app
