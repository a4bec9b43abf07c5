// That the resident memory of a drive of twenty minutes does not grow.
#include "tests/system/run/resident_memory.hpp"

namespace vergence {
namespace {

TEST(ResidentMemory, twentyMinutesTakeNoMoreThanOne) {
  constexpr int kTwenty = 20 * 60, kTen = 10 * 60, kMinute = 60;  // s, and frames
  test::expect_flat(test::growth_of({kTwenty, 0.8, kMinute}, std::chrono::seconds(100)), kTen);
}

}  // namespace
}  // namespace vergence
