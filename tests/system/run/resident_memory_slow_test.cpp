// That the resident memory of a drive of ten hours does not grow.
#include "tests/system/run/resident_memory.hpp"

namespace vergence {
namespace {

TEST(ResidentMemory, isAfterTenHoursWhatItWasAfterTheFirstThousandFrames) {
  constexpr int kTenHours = 36'000, kFive = 18'000;  // s, and frames
  // A minute at 20 Hz: the calibration has been solved, stacks and allocator have been that deep.
  constexpr int kMinute = 1200;
  test::expect_flat(test::growth_of({kTenHours, 0.025, kMinute}, std::chrono::minutes(25)), kFive);
}

}  // namespace
}  // namespace vergence
