#include <algorithm>

#include "tests/support/camera_options.hpp"
#include "tests/unit/drivers/gige/gige_bench_rig.hpp"

namespace vergence::test {
namespace {

/// Counters of a run against what the simulator did. The counters since start(), the report since
/// the simulator's beginning.
void expect_equal_accounts(const GigeBench& b, std::size_t received) {
  const GigeCameraReport r = b.simulator->report();
  const CameraStatistics s = b.camera->statistics();
  EXPECT_EQ(s.delivered, received);
  EXPECT_EQ(s.underruns, 0U);
  EXPECT_EQ(s.delivered - s.incomplete, r.whole) << "frames that were sent whole";
  EXPECT_EQ(s.incomplete, r.incomplete) << "frames that were sent in part, with their leader";
  EXPECT_EQ(s.lost, r.headless + r.nothing) << "frames without a leader";
  EXPECT_EQ(b.numbers.size(), r.whole);
}

CameraConfiguration many_packets(const GigeBench& b, const char* resend) {
  CameraConfiguration c = b.wish();
  // A frame has 137 packets.
  test::give<gige::Options>(&c, "packet_size", "600");
  test::give<gige::Options>(&c, "resend", resend);
  return c;
}

TEST(GigeLoss, damagedFramesAreIncompleteOthersWhole) {
  for (const char* resend : {"off", "on"}) {
    GigeBench b;
    b.configure(many_packets(b, resend));
    b.start();
    std::size_t received = b.read(5).size();
    b.simulator->tear_frames(4);
    const auto frames = b.read(15);
    EXPECT_EQ(std::count_if(frames.begin(), frames.end(),
                            [](const Frame& f) { return f.status == FrameStatus::incomplete; }),
              4);
    received += frames.size() + b.drain().size();
    EXPECT_EQ(b.camera->statistics().lost, 0U);
    expect_equal_accounts(b, received);
  }
}

TEST(GigeLoss, everyRandomPacketLossIsCounted) {
  for (const std::uint64_t seed : {1, 2}) {
    GigeBench b({.seed = seed});
    b.configure(many_packets(b, "off"));
    b.start();
    std::size_t received = b.read(3).size();
    // A quarter of the frames arrives complete.
    b.simulator->set_loss(0.01);
    received += b.read(12).size();
    b.simulator->set_loss(0);
    received += b.read(3).size();
    received += b.drain().size();
    EXPECT_GT(b.camera->statistics().incomplete, 12U);
    expect_equal_accounts(b, received);
  }
}

TEST(GigeLoss, resendRecoversHalfAPercentLoss) {
  GigeBench b;
  b.configure(many_packets(b, "auto"));
  b.start();
  std::size_t received = b.read(3).size();
  // Half of the frames lose a packet.
  b.simulator->set_loss(0.005);
  received += b.read(100).size();
  b.simulator->set_loss(0);
  received += b.read(3).size() + b.drain().size();
  const GigeCameraReport r = b.simulator->report();
  EXPECT_GT(r.dropped, 50U);
  EXPECT_GE(r.resent, r.dropped);
  EXPECT_EQ(r.whole, r.exposed);
  EXPECT_EQ(b.camera->statistics().lost, 0U);
  EXPECT_EQ(b.camera->statistics().incomplete, 0U);
  expect_equal_accounts(b, received);
}

}  // namespace
}  // namespace vergence::test
