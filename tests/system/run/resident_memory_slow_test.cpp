// That the resident memory of a drive of a day does not grow.
#include "tests/system/run/resident_memory.hpp"

namespace vergence {
namespace {

TEST(ResidentMemory, isAfterADayWhatItWasAndEveryFrameHasAPoseStill) {
  constexpr int kDay = 86'400, kTwelve = 43'200;  // s, and frames
  // A minute at 20 Hz: the calibration has been solved, stacks and allocator have been that deep.
  constexpr int kMinute = 1200;
  const test::Growth growth = test::growth_of({kDay, 0.0104, kMinute}, std::chrono::minutes(55));
  test::expect_flat(growth, kTwelve);
  EXPECT_EQ(growth.usable, static_cast<int>(test::kLastFrames));
}

}  // namespace
}  // namespace vergence
