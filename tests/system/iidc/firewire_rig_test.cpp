#include <fstream>

#include "drivers/iidc/iidc.hpp"
#include "tests/rigs/iidc_rig.hpp"
#include "tests/support/mentions.hpp"

namespace vergence::test {

struct BusUnderTest {
  static constexpr const char* kEmulator = "sim_1394";
  static constexpr const char* kSent = "transmitted";
  /// The truncated frame's buffer swallows the beginning of the next one.
  static constexpr std::uint64_t kLostWithIncomplete = 1;
  static std::unique_ptr<CameraDriver> driver() { return iidc::make_1394_driver(); }
  // Nodes are numbered along the bus: the last one goes.
  static void unplug(Emulator* e, unsigned camera) { e->command("plug " + std::to_string(camera)); }
  static void replug(Emulator* e, unsigned camera) {
    e->command("plug " + std::to_string(camera + 1));
  }
};

}  // namespace vergence::test

#include "tests/system/iidc/rig_cases.hpp"  // NOLINT: after what it is made of

namespace vergence::test {
namespace {

TEST_F(IidcRig, missingBusBandwidthIsReported) {
  CameraConfiguration wide = usual();
  wide.width = 1280;
  wide.height = 960;
  // At S400, each camera needs 3064 of 4915 units.
  wide.rate_hz = 20;
  wide.sharing = 2;
  ASSERT_NO_FATAL_FAILURE(begin(wide));
  EXPECT_EQ(cameras_[0]->start(nullptr), DeviceStatus::ok) << cameras_[0]->last_error();
  EXPECT_EQ(cameras_[1]->start(nullptr), DeviceStatus::no_bandwidth);
  EXPECT_TRUE(vergence::test::mentions(cameras_[1]->last_error(), "3064 of 4915"));
  (void)end();
}

TEST_F(IidcRig, busClockIsSharedAcrossItsWrap) {
  ASSERT_NO_FATAL_FAILURE(begin(usual()));
  ASSERT_NO_FATAL_FAILURE(start());
  // Fifteen seconds: with the card's clock at 100 s the wrap at 128 s comes in between, whatever
  // the start took.
  int offset_s = 0;
  std::ifstream("/sys/module/vergence_1394/parameters/offset_s") >> offset_s;
  const bool wraps = offset_s != 0;
  const std::uint64_t frames = wraps ? 30 * 32 : 60;
  ASSERT_TRUE(collector_->read(frames, Duration::seconds(90)));
  (void)end();
  const Account &a = collector_->account(0), &b = collector_->account(1);
  EXPECT_EQ(a.wrong + b.wrong, 0U);
  std::size_t compared = 0;
  for (std::size_t i = 0, j = 0; i < a.middles.size() && j < b.middles.size();) {
    if (a.middles[i] == b.middles[j]) {
      EXPECT_EQ(a.starts[i], b.starts[j]) << "exposed at once, stamped at once";
      ++compared, ++i, ++j;
    } else {
      ++(a.middles[i] < b.middles[j] ? i : j);
    }
  }
  EXPECT_GT(compared, frames / 2);
  // Against the host's clock the card's runs 50 ppm fast and never jumps.
  const double host = static_cast<double>(a.middles.back() - a.middles.front());
  const double bus = static_cast<double>(a.starts.back() - a.starts.front());
  EXPECT_NEAR(bus / host - 1, wraps ? 50e-6 : 0, 1e-6);
  for (std::size_t i = 1; i < a.starts.size(); ++i) ASSERT_GT(a.starts[i], a.starts[i - 1]);
}

}  // namespace
}  // namespace vergence::test
