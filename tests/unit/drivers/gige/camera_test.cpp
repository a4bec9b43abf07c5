#include <sys/socket.h>

#include <bit>

#include "drivers/gige/detail/glib.hpp"
#include "drivers/gige/detail/link.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/gige/gige_bench_rig.hpp"

namespace vergence::test {
namespace {

namespace reg = gige_register;

float real(std::uint32_t word) { return std::bit_cast<float>(word); }

TEST(GigeCamera, isConfiguredByOldAndNewFeatureNames) {
  for (const bool old_names : {false, true}) {
    GigeBench b({.old_names = old_names});
    CameraConfiguration c = b.wish();
    c.width = 160, c.height = 120, c.offset_x = 64, c.offset_y = 32;
    c.exposure = Duration::microseconds(1234);
    c.rate_hz = 40;
    CameraConfiguration actual;
    ASSERT_EQ(b.camera->configure(c, &actual), DeviceStatus::ok) << b.camera->last_error();
    EXPECT_EQ(b.reg(reg::width), 160U);
    EXPECT_EQ(b.reg(reg::height), 120U);
    EXPECT_EQ(b.reg(reg::offset_x), 64U);
    EXPECT_EQ(b.reg(reg::offset_y), 32U);
    EXPECT_FLOAT_EQ(real(b.reg(reg::exposure_time)), 1234.0F);
    EXPECT_FLOAT_EQ(real(b.reg(reg::frame_rate)), 40.0F);
    EXPECT_EQ(b.reg(reg::exposure_auto), 0U);
    EXPECT_EQ(b.reg(reg::gain_auto), 0U);
    EXPECT_EQ(b.reg(reg::trigger_mode), 0U);
    EXPECT_EQ(actual.pixel_format, "Mono8");
    EXPECT_EQ(actual.exposure, Duration::microseconds(1234));
    EXPECT_EQ(b.camera->info().serial, "UNIT-0");
    EXPECT_EQ(b.camera->info().place, b.simulator->options().address);
  }
}

TEST(GigeCamera, refusalNamesWhatTheCameraOffers) {
  GigeBench b;
  b.configure(b.wish());
  const auto refused = [&](auto&& change, const std::string& word) {
    CameraConfiguration c = b.wish();
    change(&c);
    EXPECT_EQ(b.camera->configure(c, nullptr), DeviceStatus::unsupported) << word;
    EXPECT_TRUE(mentions(b.camera->last_error(), word));
  };
  refused([](auto* c) { c->width = 1920; }, "16 to 320 px");
  refused([](auto* c) { c->width = 316; }, "steps of 8");
  refused([](auto* c) { c->pixel_format = "RGB8"; }, "Mono8, Mono12, BayerGB8");
  refused([](auto* c) { c->gain_db = 48; }, "0 to 24 dB");
  refused([](auto* c) { c->rate_hz = 450, c->exposure = Duration::microseconds(100); },
          "0.5 to 400 Hz");
  refused([](auto* c) { c->exposure = Duration::microseconds(2); }, "10 to 900000 us");
  refused(
      [](auto* c) {
        c->trigger = CameraTrigger::hardware;
        c->options = gige::Options{.line = "Line7"};
      },
      "Software, Line1, Line2");
  refused(
      [](auto* c) {
        c->options = gige::Options{.features = {{"TriggerOverlap", "PreviousFrame"}}};
      },
      "Off, ReadOut");
  refused([](auto* c) { c->options = gige::Options{.features = {{"Gamma", "2"}}}; }, "Gamma");
  refused([](auto* c) { c->options = gige::Options{.packet_size = 2}; }, "packet_size");
  // The earlier configuration is active again.
  b.start();
  EXPECT_EQ(b.read(3).size(), 3U);
  EXPECT_EQ(b.reg(reg::width), 320U);
}

TEST(GigeCamera, hardwareTriggerSetsLineEdgeAndOptions) {
  GigeBench b;
  CameraConfiguration c = b.wish();
  c.trigger = CameraTrigger::hardware;
  c.options = gige::Options{.line = "Line2",
                            .edge = gige::TriggerEdge::falling,
                            .features = {{"TriggerOverlap", "ReadOut"},
                                         {"TriggerDelay", "250"},
                                         {"LineSelector", "Line2"},
                                         {"LineMode", "Output"},
                                         {"LineSource", "ExposureActive"}}};
  b.configure(c);
  EXPECT_EQ(b.reg(reg::trigger_mode), 1U);
  EXPECT_EQ(b.reg(reg::trigger_source), 2U);
  EXPECT_EQ(b.reg(reg::trigger_activation), 1U);
  EXPECT_EQ(b.reg(reg::trigger_overlap), 1U);
  EXPECT_FLOAT_EQ(real(b.reg(reg::trigger_delay)), 250.0F);
  EXPECT_EQ(b.reg(reg::line_mode), 1U);
  EXPECT_EQ(b.reg(reg::line_source), 1U);
}

TEST(GigeCamera, everyPulseIsOneFrameAndRestIsNoError) {
  GigeBench b;
  CameraConfiguration c = b.wish();
  c.trigger = CameraTrigger::hardware;
  b.configure(c);
  b.start();
  Frame frame;
  EXPECT_EQ(b.camera->wait(Duration::milliseconds(1500), &frame), DeviceStatus::timeout)
      << "no pulse, no frame, and still there";
  for (std::uint64_t n = 100; n < 110; ++n) {
    b.simulator->pulse(n);
    ASSERT_EQ(b.read(1).size(), 1U) << n;
    EXPECT_EQ(b.numbers.back(), n);
  }
  EXPECT_EQ(b.camera->trigger_once(), DeviceStatus::unsupported);
}

TEST(GigeCamera, stampsAreExposureStartsInNanoseconds) {
  for (const bool end : {false, true}) {
    GigeCameraOptions o{.tick_frequency = end ? 125'000'000U : 62'500'000U};
    const std::int64_t tick_ns = end ? 8 : 16;
    GigeBench b(o);
    CameraConfiguration c = b.wish();
    test::give<gige::Options>(&c, "stamp_at", end ? "end" : "start");
    b.configure(c);
    b.start();
    const auto frames = b.read(10);
    ASSERT_EQ(b.numbers.size(), frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      // Image n is exposed at n periods of 20 ms.
      const auto ticks =
          b.simulator->ticks(HostStamp(static_cast<std::int64_t>(b.numbers[i]) * 20'000'000));
      EXPECT_EQ(frames[i].exposure_start, DeviceStamp(static_cast<std::int64_t>(ticks) * tick_ns) -
                                              (end ? c.exposure : Duration{}));
      EXPECT_EQ(frames[i].exposure, c.exposure);
    }
    EXPECT_EQ(b.camera->timing().resolution, Duration::nanoseconds(tick_ns));
    EXPECT_GE(b.camera->timing().min_delay, end ? Duration{} : c.exposure);
  }
}

TEST(GigeCamera, chunkModeIsSwitchedOff) {
  GigeBench b;
  b.simulator->write(reg::chunk_mode, 1);
  b.configure(b.wish());
  EXPECT_EQ(b.reg(reg::chunk_mode), 0U);
}

TEST(GigeCamera, cameraWithoutClockIsStampedByArrival) {
  GigeBench b({.tick_frequency = 0});
  b.configure(b.wish());
  EXPECT_TRUE(mentions(b.camera->remark(), "no clock"));
  b.start();
  for (const Frame& f : b.read(5))
    EXPECT_EQ(f.exposure_start, DeviceStamp(f.arrival.ns()) - b.camera->timing().min_delay);
}

TEST(GigeCamera, ptpIsEnabledAndItsStateReported) {
  GigeBench b;
  CameraConfiguration c = b.wish();
  test::give<gige::Options>(&c, "ptp", "on");
  b.configure(c);
  EXPECT_EQ(b.reg(reg::ptp_enable), 1U);
  EXPECT_EQ(b.camera->remark().find("PTP"), std::string::npos)
      << "it is a slave: " << b.camera->remark();
  EXPECT_EQ(b.camera->timing().resolution, Duration::nanoseconds(1));
  GigeBench without({.old_names = true}, 1);
  EXPECT_EQ(without.camera->configure(c, nullptr), DeviceStatus::unsupported);
  EXPECT_TRUE(mentions(without.camera->last_error(), "PTP"));
}

TEST(GigeCamera, packetSizeAndDelayFitTheLink) {
  GigeBench b;
  CameraConfiguration c = b.wish();
  c.sharing = 2;
  test::give<gige::Options>(&c, "link_mbps", "1000");
  test::give<gige::Options>(&c, "packet_size", "1500");
  b.configure(c);
  EXPECT_EQ(b.reg(0xD04) & 0xFFFFU, 1500U);
  // 13.534 µs of 125 MHz.
  EXPECT_EQ(b.reg(0xD08), 1692U);
  test::give<gige::Options>(&c, "link_mbps", "50");
  EXPECT_EQ(b.camera->configure(c, nullptr), DeviceStatus::unsupported);
  EXPECT_TRUE(mentions(b.camera->last_error(),
                       "2 cameras of 320 x 240 Mono8 at 50 Hz do not fit on lo of 50 Mbit/s"));
  test::give<gige::Options>(&c, "packet_size", "20000");
  test::give<gige::Options>(&c, "link_mbps", "1000");
  b.configure(c);
  EXPECT_TRUE(mentions(b.camera->remark(), "packets of 16000 bytes instead of 20000"));
}

TEST(GigeCamera, receiveBufferPrecedesTheFirstPacket) {
  GigeBench b;
  // The sizes are below the limit of any system.
  for (const int kib : {64, 150}) {
    CameraConfiguration c = b.wish();
    test::give<gige::Options>(&c, "socket_buffer_kb", std::to_string(kib));
    b.configure(c);
    b.start();
    const int socket = gige::find_udp_socket(static_cast<std::uint16_t>(b.reg(0xD00)));
    ASSERT_GE(socket, 0);
    int bytes = 0;
    socklen_t length = sizeof bytes;
    ASSERT_EQ(::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, &length), 0);
    EXPECT_EQ(bytes, 2 * kib * 1024) << "the kernel doubles it";
    b.camera->stop();
  }
}

/// Aravis's own simulated camera, of which nothing here is by the same hand as the driver: older
/// names, no resend, no test packet.
TEST(GigeFakeCamera, configuresAndStreams) {
  const gige::Object<ArvGvFakeCamera> fake(arv_gv_fake_camera_new("127.0.0.1", "FAKE-1"));
  if (fake == nullptr || arv_gv_fake_camera_is_running(fake.get()) == FALSE)
    GTEST_SKIP() << "needs UDP port 3956 of 127.0.0.1: stop the program that uses it";
  DeviceStatus status = DeviceStatus::ok;
  const auto driver = gige::make_driver();
  const auto camera = driver->open("127.0.0.1", &status);
  ASSERT_NE(camera, nullptr) << to_string(status) << driver->last_error();
  CameraConfiguration c{256, 200, 40, Duration::milliseconds(3), 0, CameraTrigger::free};
  test::give<gige::Options>(&c, "packet_size", "1400");
  ASSERT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  Frame frame;
  // The ids wrap after 135.
  for (std::uint64_t n = 0; n < 150; ++n) {
    ASSERT_EQ(camera->wait(Duration::seconds(2), &frame), DeviceStatus::ok)
        << n << camera->last_error();
    EXPECT_EQ(frame.status, FrameStatus::complete);
    EXPECT_EQ(frame.counter, n);
    camera->release(frame.slot);
  }
  EXPECT_EQ(camera->statistics().lost, 0U);
  camera->stop();
  c.trigger = CameraTrigger::software;
  ASSERT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->trigger_once(), DeviceStatus::ok) << camera->last_error();
  EXPECT_EQ(camera->wait(Duration::seconds(2), &frame), DeviceStatus::ok);
}

}  // namespace
}  // namespace vergence::test
