// That the resident memory of a drive of ten hours does not grow.
#include "tests/system/run/resident_memory.hpp"

namespace vergence {
namespace {

TEST(ResidentMemory, isAfterTenHoursWhatItWasAfterAMinute) {
  constexpr int kTenHours = 36'000, kFive = 18'000;  // s, and frames
  test::expect_flat(test::growth_of({kTenHours, 0.025}, std::chrono::minutes(25)), kFive);
}

}  // namespace
}  // namespace vergence
