#include "tests/system/gige/pairs.hpp"

namespace vergence {
namespace {

using test::Pairs;

TEST(GigePairs, withoutResendEveryPairThatCameWholePairsUp) {
  if (const std::string why = test::socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  constexpr int kPulses = 120;
  const Pairs p("off", 0.01, 40, kPulses);
  const auto whole = p.whole();
  EXPECT_EQ(p.complete.size(), whole.size());
  for (const std::uint64_t n : whole)
    EXPECT_TRUE(std::binary_search(p.complete.begin(), p.complete.end(), n))
        << "pair " << n << " came whole";
  EXPECT_LT(p.complete.size(), kPulses - 15U) << "a fifth of the frames is torn";
  EXPECT_GT(p.complete.size(), 40U);
  const auto& c = p.source->counters();
  EXPECT_EQ(c.dropped_sets, 0U);
  for (std::size_t k = 0; k < 2; ++k) {
    const test::GigeCameraReport r = p.simulators[k]->report();
    const CameraStatistics s = p.cameras[k].device->statistics();
    EXPECT_EQ(r.exposed, static_cast<std::uint64_t>(kPulses));
    EXPECT_EQ(s.delivered - s.torn, r.whole);
    EXPECT_EQ(s.torn, r.torn);
    EXPECT_EQ(s.lost, r.headless + r.nothing);
  }
}

}  // namespace
}  // namespace vergence
