#include "tests/system/gige/pairs.hpp"

namespace vergence {
namespace {

TEST(GigeMinute, withResendAndHalfAPercentOfPacketsLostNoFrameIsLost) {
  if (const std::string why = test::socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  constexpr int kRate = 30, kPulses = 60 * kRate;
  const test::Pairs p("on", 0.005, kRate, kPulses);
  EXPECT_EQ(p.complete.size(), static_cast<std::size_t>(kPulses));
  for (std::size_t k = 0; k < 2; ++k) {
    const test::GigeCameraReport r = p.simulators[k]->report();
    const CameraStatistics s = p.cameras[k].device->statistics();
    EXPECT_GT(r.dropped, 120U) << "of 39600 packets 198";
    EXPECT_EQ(r.whole, static_cast<std::uint64_t>(kPulses));
    EXPECT_EQ(s.delivered, static_cast<std::uint64_t>(kPulses));
    EXPECT_EQ(s.torn + s.lost + s.underruns, 0U);
  }
}

}  // namespace
}  // namespace vergence
