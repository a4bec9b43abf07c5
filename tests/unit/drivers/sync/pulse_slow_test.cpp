
#include "tests/unit/drivers/sync/pulse_rules.hpp"

namespace vergence {
namespace {

TEST(PulseSlow, tenHoursGiveNoWrongPairForAnySeed) {
  for (std::uint64_t seed = 2; seed <= 12; ++seed) testing::expect_ten_hours_right(seed);
}

TEST(PulseSlow, noWrongPairIsVerified) {
  for (std::uint64_t seed = 1000; seed < 2000; ++seed) testing::expect_never_wrong(seed, 60);
}

}  // namespace
}  // namespace vergence
