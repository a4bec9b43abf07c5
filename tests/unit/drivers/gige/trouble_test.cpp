#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/gige/gige_bench_rig.hpp"

namespace vergence::test {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Waits for `disconnected`, releasing what comes; false: not within the limit.
bool goes(GigeBench* b, double limit_s) {
  const auto begin = Clock::now();
  for (Frame frame; seconds_since(begin) < limit_s;) {
    const DeviceStatus status = b->camera->wait(Duration::milliseconds(100), &frame);
    if (status == DeviceStatus::disconnected) return true;
    if (status == DeviceStatus::ok) b->camera->release(frame.slot);
  }
  return false;
}

/// Asks until it is not `disconnected`, or until the limit.
DeviceStatus start_again(GigeBench* b, double limit_s) {
  const auto begin = Clock::now();
  DeviceStatus status = DeviceStatus::disconnected;
  while ((status = b->camera->start(nullptr)) == DeviceStatus::disconnected &&
         seconds_since(begin) < limit_s)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return status;
}

/// Empty: what the loopback interface sends to everyone arrives, as a search for cameras needs it.
/// Else the message to skip with.
std::string broadcast_obstacle() {
  const int in = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0),
            out = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), on = 1;
  sockaddr_in everyone{}, own{};
  everyone.sin_family = own.sin_family = AF_INET;
  everyone.sin_addr.s_addr = htonl(INADDR_BROADCAST);
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* const to = reinterpret_cast<sockaddr*>(&everyone);
  socklen_t size = sizeof everyone;
  pollfd arrived{in, POLLIN, 0};
  const bool arrives = ::bind(in, to, size) == 0 && ::getsockname(in, to, &size) == 0 &&
                       ::bind(out, reinterpret_cast<sockaddr*>(&own), sizeof own) == 0 &&
                       ::setsockopt(out, SOL_SOCKET, SO_BROADCAST, &on, sizeof on) == 0 &&
                       ::sendto(out, &on, 1, 0, to, size) == 1 && ::poll(&arrived, 1, 500) == 1;
  (void)::close(in), (void)::close(out);
  return arrives ? ""
                 : "needs broadcasts on the loopback interface: run it outside of this container";
}

TEST(GigeTrouble, camerasAreDiscoveredAndOpenedBySerial) {
  if (const std::string why = broadcast_obstacle(); !why.empty()) GTEST_SKIP() << why;
  GigeCameraOptions o{.address = GigeCamera::address(200),
                      .serial = "FIND-" + std::to_string(::getpid() % 100'000)};
  const GigeCamera simulator(o);
  const auto driver = gige::make_driver();
  bool found = false;
  for (const DeviceInfo& d : driver->enumerate()) {
    if (d.serial != o.serial) continue;
    found = true;
    EXPECT_EQ(d.driver, "gige");
    EXPECT_EQ(d.place, o.address);
    EXPECT_EQ(d.model, "Vergence Simulator");
  }
  EXPECT_TRUE(found) << driver->last_error();
  DeviceStatus status = DeviceStatus::failed;
  EXPECT_NE(driver->open(o.serial, &status), nullptr) << to_string(status);
  EXPECT_EQ(status, DeviceStatus::ok);
}

TEST(GigeTrouble, cameraOfAnotherProgramIsBusy) {
  GigeCameraOptions o{.address = GigeCamera::address(201)};
  GigeCamera simulator(o);
  simulator.take_control(true);
  const auto driver = gige::make_driver();
  DeviceStatus status = DeviceStatus::ok;
  EXPECT_EQ(driver->open(o.address, &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::busy);
  EXPECT_TRUE(mentions(driver->last_error(), "another program"));
  simulator.take_control(false);
  EXPECT_NE(driver->open(o.address, &status), nullptr) << "and free again";
}

TEST(GigeTrouble, silentCameraIsReportedAndComesBack) {
  GigeBench b;
  b.stream();
  b.simulator->silence(true);
  ASSERT_TRUE(goes(&b, 6));
  EXPECT_TRUE(mentions(b.camera->last_error(), "sends no images"));
  b.simulator->silence(false);
  ASSERT_EQ(start_again(&b, 10), DeviceStatus::ok) << b.camera->last_error();
  const auto frames = b.read(3);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].counter, 0U);
  EXPECT_EQ(b.camera->statistics().starts, 2U);
}

TEST(GigeTrouble, otherImageSizeIsReportedAndIncomplete) {
  for (const auto& [width, height] : {std::pair{160, 120}, {640, 480}}) {
    GigeBench b;
    b.stream();
    const std::size_t whole = b.numbers.size();
    b.simulator->lie_about_size(width, height);
    ASSERT_TRUE(goes(&b, 6)) << width;
    const CameraStatistics s = b.camera->statistics();
    EXPECT_LE(s.delivered - s.incomplete, whole + 5) << "what was on its way before";
    EXPECT_TRUE(
        mentions(b.camera->last_error(), std::to_string(width) + " x " + std::to_string(height)));
  }
}

TEST(GigeTrouble, unpluggedIdleCameraIsNoticed) {
  GigeBench b;
  CameraConfiguration c = b.wish();
  c.trigger = CameraTrigger::hardware;
  b.configure(c);
  b.start();
  b.simulator->unplug();
  EXPECT_TRUE(goes(&b, 10)) << "no pulses, so only asking shows it";
  const auto begin = Clock::now();
  b.camera->stop();
  // Measured: 7.5 s on a quiet machine, 10 on a busy one.
  EXPECT_LT(seconds_since(begin), 15) << "stop() waits for one attempt at most";
}

GigeCameraOptions at_address_of(const GigeBench& b, const std::string& serial) {
  GigeCameraOptions o = b.simulator->options();
  o.serial = serial;
  return o;
}

TEST(GigeTrouble, cameraIsFoundAtItsNewAddress) {
  if (const std::string why = broadcast_obstacle(); !why.empty()) GTEST_SKIP() << why;
  GigeBench b({}, 202);
  b.stream();
  const GigeCameraOptions other = at_address_of(b, "OTHER");
  GigeCameraOptions moved = b.simulator->options();
  moved.address = GigeCamera::address(203);
  b.simulator.reset();
  const GigeCamera stranger(other);
  b.simulator = std::make_unique<GigeCamera>(moved);
  ASSERT_TRUE(goes(&b, 12));
  ASSERT_EQ(start_again(&b, 30), DeviceStatus::ok) << b.camera->last_error();
  EXPECT_EQ(b.read(3).size(), 3U);
  EXPECT_EQ(stranger.report().starts, 0U);
}

TEST(GigeTrouble, lostControlIsADisconnect) {
  GigeBench b;
  b.stream();
  b.simulator->take_control(true);
  EXPECT_TRUE(goes(&b, 12));
}

}  // namespace
}  // namespace vergence::test
