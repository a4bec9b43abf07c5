#include <gtest/gtest.h>

#include "tests/unit/app/recording/kill_check.hpp"

namespace vergence::app {
namespace {

TEST(CrashedRecordingSlow, readsBackAfterEachOf100Kills) {
  const auto lost_ms = test::lost_before_kills(100);
  RecordProperty("median_lost_ms", std::to_string(lost_ms[50]));
  RecordProperty("max_lost_ms", std::to_string(lost_ms.back()));
  EXPECT_LE(lost_ms[50], 100);
  EXPECT_LE(lost_ms.back(), 1000);
}

}  // namespace
}  // namespace vergence::app
