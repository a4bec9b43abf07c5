
#include "drivers/clock.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/iidc/camera_under_test.hpp"

namespace vergence::test {
namespace {

using namespace iidc;
constexpr std::uint64_t kCommand = kRegisterSpace + 0xF00000, kFormat7 = kRegisterSpace + 0xF08000;
// Slack for a busy machine.
constexpr Duration kSlack = Duration::milliseconds(300);

using IidcFaults = WithCamera;

TEST_F(IidcFaults, registerNeverReadyTimesOut) {
  c.bus->stuck[kFormat7 + reg::format7::kValueSetting] = reg::format7::kValueApply;
  const HostStamp begun = monotonic_now();
  EXPECT_EQ(c.camera->configure(CameraUnderTest::usual(), nullptr), DeviceStatus::timeout);
  EXPECT_GE(monotonic_now() - begun, kPatience);
  EXPECT_LE(monotonic_now() - begun, kPatience + kSlack);
  EXPECT_EQ(c.camera->last_error(), "register 0xf0807c did not become ready in time");
  EXPECT_EQ(c.camera->start(nullptr), DeviceStatus::bad_configuration);
  c.bus->stuck.clear();
  c.start();
}

TEST_F(IidcFaults, busySoftwareTriggerTimesOut) {
  requested.trigger = CameraTrigger::software;
  c.start(requested);
  c.bus->stuck[kCommand + reg::kSoftwareTrigger] = bit(31);
  const HostStamp begun = monotonic_now();
  EXPECT_EQ(c.camera->trigger_once(), DeviceStatus::timeout);
  EXPECT_LE(monotonic_now() - begun, kPatience + kSlack);
  EXPECT_FALSE(c.camera->last_error().empty());
}

TEST_F(IidcFaults, refusedRegionOrPacketIsNamed) {
  c.bus->stuck[kFormat7 + reg::format7::kValueSetting] = reg::format7::kErrorRegion;
  EXPECT_EQ(c.camera->configure(CameraUnderTest::usual(), nullptr), DeviceStatus::unsupported);
  EXPECT_TRUE(mentions(c.camera->last_error(), "refuses the region 640 x 480"));
  c.bus->stuck[kFormat7 + reg::format7::kValueSetting] = reg::format7::kErrorPacket;
  EXPECT_EQ(c.camera->configure(CameraUnderTest::usual(), nullptr), DeviceStatus::unsupported);
  EXPECT_TRUE(mentions(c.camera->last_error(), "refuses packets"));
}

TEST_F(IidcFaults, anyRefusedRegisterGivesAStatus) {
  CameraUnderTest probe;
  probe.start();
  probe.camera->stop();
  std::set<std::uint64_t> used;
  for (const auto& [address, value] : probe.bus->written) used.insert(address);
  for (std::uint32_t offset = 0; offset < 0x900; offset += 4) used.insert(kCommand + offset);
  for (std::uint32_t offset = 0; offset < 0x80; offset += 4) used.insert(kFormat7 + offset);
  for (const std::uint64_t address : used) {
    CameraUnderTest own;
    own.bus->refused.insert(address);
    const DeviceStatus status = own.camera->configure(CameraUnderTest::usual(), nullptr);
    EXPECT_TRUE(status == DeviceStatus::ok || status == DeviceStatus::unsupported)
        << std::hex << address << ' ' << to_string(status);
    EXPECT_EQ(status == DeviceStatus::ok, own.camera->last_error().empty()) << std::hex << address;
  }
}

TEST_F(IidcFaults, invalidRegisterContentsGiveAStatus) {
  for (const std::uint32_t pattern : {0xFFFF'FFFFU, 0x7F80'0001U, 0xAAAA'AAAAU, 0x8000'0000U})
    for (std::uint32_t first = 0x100; first < 0x900; first += 0x40) {
      CameraUnderTest own;
      for (std::uint32_t offset = first; offset < first + 0x40; offset += 4)
        own.bus->stuck[kCommand + offset] = pattern;
      (void)own.camera->configure(CameraUnderTest::usual(), nullptr);
      (void)own.camera->start(nullptr);
      own.bus->expose(2);
      own.camera->stop();
    }
}

TEST_F(IidcFaults, unpluggedCameraReturnsAsConfigured) {
  c.start();
  c.bus->expose(2);
  c.bus->unplug();
  // The frame is not delivered.
  c.bus->expose(1);
  EXPECT_EQ(c.read_and_release().counter, 0U);
  const Frame held = c.read();
  Frame f;
  EXPECT_EQ(c.camera->wait(Duration::milliseconds(20), &f), DeviceStatus::disconnected);
  EXPECT_EQ(f.arrival, c.bus->now() - Duration::milliseconds(100));
  EXPECT_EQ(c.camera->wait(Duration{}, &f), DeviceStatus::disconnected);
  EXPECT_EQ(c.camera->start(nullptr), DeviceStatus::disconnected);
  EXPECT_EQ(c.camera->wait(Duration{}, &f), DeviceStatus::disconnected);
  EXPECT_EQ(c.camera->view(held.slot).at(0, 1), 2) << "an image that is held stays";
  c.bus->replug();
  EXPECT_FALSE(c.bus->model().transmitting);
  ASSERT_EQ(c.camera->start(nullptr), DeviceStatus::ok) << c.camera->last_error();
  EXPECT_EQ(c.bus->model().format, 7U) << "all registers are written anew";
  EXPECT_EQ(c.bus->reopened(), 2);
  c.bus->expose(1);
  EXPECT_EQ(c.read_and_release().counter, 0U);
  c.camera->release(held.slot);
}

TEST_F(IidcFaults, unresponsiveCameraIsDisconnectedAtOnce) {
  c.configure();
  c.bus->all_accesses = DeviceStatus::timeout;
  EXPECT_EQ(c.camera->start(nullptr), DeviceStatus::disconnected);
  EXPECT_TRUE(mentions(c.camera->last_error(), "did not become ready"));
  c.bus->all_accesses = DeviceStatus::ok;
  EXPECT_EQ(c.camera->start(nullptr), DeviceStatus::ok);
}

TEST_F(IidcFaults, replugWithoutBandwidthIsRetried) {
  c.start();
  c.bus->unplug();
  Frame f;
  while (c.camera->wait(Duration::milliseconds(20), &f) == DeviceStatus::ok)
    c.camera->release(f.slot);
  c.bus->replug();
  c.bus->start_status = DeviceStatus::no_bandwidth;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(c.camera->start(nullptr), DeviceStatus::no_bandwidth);
    EXPECT_FALSE(c.bus->model().transmitting);
    EXPECT_FALSE(c.camera->last_error().empty());
    EXPECT_EQ(c.camera->wait(Duration{}, &f), DeviceStatus::disconnected);
  }
  c.bus->start_status = DeviceStatus::ok;
  ASSERT_EQ(c.camera->start(nullptr), DeviceStatus::ok) << c.camera->last_error();
  c.bus->expose(1);
  EXPECT_EQ(c.read_and_release().status, FrameStatus::complete);
}

TEST_F(IidcFaults, silentCameraRestartsWhileAnImageIsHeld) {
  c.start();
  c.bus->expose(2);
  (void)c.read_and_release();
  const Frame held = c.read();
  const std::uint8_t seen = c.camera->view(held.slot).at(0, 1);
  Frame f;
  DeviceStatus status = DeviceStatus::timeout;
  // The loop takes 30 s at most.
  for (int i = 0; i < 300 && status == DeviceStatus::timeout; ++i)
    status = c.camera->wait(Duration::milliseconds(100), &f);
  ASSERT_EQ(status, DeviceStatus::disconnected);
  ASSERT_EQ(c.camera->start(nullptr), DeviceStatus::ok) << c.camera->last_error();
  EXPECT_EQ(c.bus->reopened(), 1);
  EXPECT_EQ(c.camera->view(held.slot).at(0, 1), seen) << "an image that is held stays";
  c.camera->release(held.slot);
  for (std::size_t i = 0; i < 2 * c.bus->shape().buffers; ++i) {
    c.bus->expose(1);
    EXPECT_EQ(c.read_and_release().status, FrameStatus::complete);
  }
}

TEST_F(IidcFaults, streamOutOfStepRestarts) {
  c.start();
  c.bus->expose(1);
  (void)c.read_and_release();
  for (int i = 0; i < iidc::IidcCamera::kStrays; ++i)
    c.bus->expose_tampered([](std::vector<std::uint8_t>* image, std::size_t*) {
      std::rotate(image->begin(), image->begin() + 4096, image->end());
    });
  Frame f;
  EXPECT_EQ(c.camera->wait(Duration{}, &f), DeviceStatus::disconnected);
  ASSERT_EQ(c.camera->start(nullptr), DeviceStatus::ok);
  c.bus->expose(1);
  EXPECT_EQ(c.read_and_release().status, FrameStatus::complete);
}

TEST_F(IidcFaults, restartedCounterIsFollowedAfterTwoFrames) {
  c.start();
  c.bus->expose(5);
  for (int i = 0; i < 5; ++i) (void)c.read_and_release();
  // The camera rebooted.
  c.bus->model().frames_made = 0;
  c.bus->expose(3);
  EXPECT_EQ(c.read_and_release().counter, 5U);
  EXPECT_EQ(c.read_and_release().counter, 6U);
}

}  // namespace
}  // namespace vergence::test
