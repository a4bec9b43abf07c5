// What a drive allocates on its threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "core/memory/allocation_guard.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::kSmall;
using test::run_vergence;
using test::summary_of;
using test::TemporaryFolder;
using test::text_of;

class SealedThreads : public testing::TestWithParam<const char*> {};

TEST_P(SealedThreads, allocateNothingWhileFramesCome) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "a sanitizer brings its own malloc: there is nothing to count";
  const TemporaryFolder folder;
  const auto session = folder / "s";
  const auto o =
      run_vergence("run '" + std::string(VERGENCE_SOURCE_DIR) + "/app/config/" + GetParam() +
                   "' --fast --duration 8 --out '" + session.string() + "'" + kSmall);
  ASSERT_EQ(o.code, 0) << o.err;
  const auto threads = summary_of(session)["memory"]["allocations_by_thread"];
  for (const char* name :
       {"vergence-estim", "vergence-front", "vergence-calib", "vergence-sync", "vergence-record"})
    EXPECT_EQ(threads.value(name, -1), 0) << name << " of " << threads.dump();
  const std::string log = text_of(session / "events.jsonl");
  EXPECT_GE(std::count(log.begin(), log.end(), '\n'), 3) << "the recorder had events to write";
  EXPECT_NE(o.err.find("vergence-mock "), std::string::npos)
      << "what is not 0 is printed at the end: " << o.err;
}

INSTANTIATE_TEST_SUITE_P(OfMockDrives, SealedThreads,
                         testing::Values("mock.yaml", "mock_board.yaml"));

}  // namespace
}  // namespace vergence
