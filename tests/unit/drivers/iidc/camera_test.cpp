

#include "tests/unit/drivers/conformance/shadow_camera.hpp"
#include "tests/unit/drivers/iidc/camera_under_test.hpp"

namespace vergence::test {
namespace {

using IidcCamera = WithCamera;

TEST_F(IidcCamera, framesCarryCounterStampAndPixels) {
  c.configure();
  CountingNotifier notifier;
  ASSERT_EQ(c.camera->start(&notifier), DeviceStatus::ok);
  EXPECT_TRUE(c.bus->model().transmitting);
  for (std::uint64_t n = 0; n < 5; ++n) {
    c.bus->expose(1);
    const Frame f = c.read();
    EXPECT_EQ(f.counter, n);
    EXPECT_EQ(f.status, FrameStatus::complete);
    EXPECT_EQ(f.exposure, c.actual.exposure);
    // The camera stamps the end of its exposure, in ticks of 41 ns, and its clock wraps at 128 s.
    EXPECT_NEAR(static_cast<double>(f.exposure_start.ns()),
                static_cast<double>((c.bus->camera_now() % iidc::kCycleTimeWrapNs) -
                                    c.actual.exposure.ns()),
                50);
    EXPECT_EQ(f.arrival, c.bus->now() + Duration::milliseconds(5));
    const ImageView view = c.camera->view(f.slot);
    EXPECT_EQ(view.width, 640);
    EXPECT_EQ(view.height, 480);
    EXPECT_EQ(view.data, c.bus->bytes(f.slot)) << "no copy";
    EXPECT_EQ(view.at(100, 9), (9 + n) & 0xFFU);
    c.camera->release(f.slot);
  }
  EXPECT_EQ(notifier.reported(), 5U);
  Frame f;
  EXPECT_EQ(c.camera->wait(Duration{}, &f), DeviceStatus::timeout);
  const CameraStatistics s = c.camera->statistics();
  EXPECT_EQ(s.delivered, 5U);
  EXPECT_EQ(s.lost + s.incomplete + s.underruns, 0U);
}

TEST_F(IidcCamera, stampsContinueAcrossTheBusClockWrap) {
  c.start();
  DeviceStamp last{};
  // The camera's clock runs from 100 s to 160 s.
  for (int i = 0; i < 60; ++i) {
    c.bus->expose(1, Duration::seconds(1.0));
    const Frame f = c.read_and_release();
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>((f.exposure_start - last).ns()), 1e9, 82) << i;
    }
    last = f.exposure_start;
  }
}

TEST_F(IidcCamera, shortFrameIsIncompleteAndKeepsItsNumber) {
  c.start();
  c.bus->expose(1);
  c.bus->expose_tampered([](auto*, std::size_t* bytes) { *bytes -= 512; });
  // An empty packet ends a frame.
  c.bus->expose_tampered([](auto*, std::size_t* bytes) { *bytes = 0; });
  // Four bytes contain no frame number.
  c.bus->expose_tampered([](auto*, std::size_t* bytes) { *bytes = 4; });
  c.bus->expose(1);
  EXPECT_EQ(c.read_and_release().counter, 0U);
  const Frame incomplete = c.read_and_release();
  EXPECT_EQ(incomplete.status, FrameStatus::incomplete);
  EXPECT_EQ(incomplete.counter, 1U);
  EXPECT_EQ(c.read_and_release().counter, 4U);
  const CameraStatistics s = c.camera->statistics();
  EXPECT_EQ(s.incomplete, 1U);
  EXPECT_EQ(s.lost, 2U);
}

TEST_F(IidcCamera, lostPacketIsFoundByTheNextEmbeddedStamp) {
  for (const std::size_t lost : {1U, 3U, 100U}) {
    CameraUnderTest own(true);
    own.start(CameraUnderTest::usual_with("packet_bytes", "1024"));
    own.bus->expose(1);
    // The receiver fills up with the beginning of the next frame and waits for the start of the one
    // after that.
    const std::size_t packet = own.bus->shape().packet_bytes, frame = own.bus->shape().frame_bytes;
    std::vector<std::uint8_t> first;
    own.bus->expose_tampered([&](std::vector<std::uint8_t>* image, std::size_t* bytes) {
      first = *image;
      *bytes = 0;
    });
    own.bus->expose_tampered([&](std::vector<std::uint8_t>* image, std::size_t*) {
      const std::vector<std::uint8_t> second = *image;
      *image = first;
      const std::size_t keep = frame - lost * packet, hole = packet * 5;
      std::copy(first.begin() + static_cast<std::ptrdiff_t>(hole + lost * packet), first.end(),
                image->begin() + static_cast<std::ptrdiff_t>(hole));
      std::copy(second.begin(), second.begin() + static_cast<std::ptrdiff_t>(lost * packet),
                image->begin() + static_cast<std::ptrdiff_t>(keep));
    });
    own.bus->expose(1);
    EXPECT_EQ(own.read_and_release().status, FrameStatus::complete);
    const Frame incomplete = own.read_and_release();
    EXPECT_EQ(incomplete.status, FrameStatus::incomplete) << lost;
    EXPECT_EQ(incomplete.counter, 1U);
    const Frame good = own.read_and_release();
    EXPECT_EQ(good.status, FrameStatus::complete);
    EXPECT_EQ(good.counter, 3U);
    EXPECT_EQ(own.camera->statistics().lost, 1U);
  }
}

TEST_F(IidcCamera, stampAtOptionSelectsTheStampedInstant) {
  std::vector<std::int64_t> starts;
  for (const char* at : {"start", "middle", "end"}) {
    CameraUnderTest own;
    own.start(CameraUnderTest::usual_with("stamp_at", at));
    own.bus->expose(1);
    starts.push_back(own.read_and_release().exposure_start.ns());
  }
  EXPECT_NEAR(static_cast<double>(starts[0] - starts[1]), 2.5e6, 2);
  EXPECT_NEAR(static_cast<double>(starts[0] - starts[2]), 5e6, 2);
}

TEST_F(IidcCamera, sixteenBitPixelsBecomeGreyInOwnSlots) {
  requested.pixel_format = "Mono16";
  test::give<iidc::Options>(&requested, "buffers", "5");
  c.start(requested);
  c.bus->expose(7);
  EXPECT_EQ(c.camera->statistics().underruns, 2U);
  for (std::uint64_t n = 0; n < 5; ++n) {
    const Frame f = c.read();
    EXPECT_EQ(f.counter, n);
    const ImageView view = c.camera->view(f.slot);
    EXPECT_EQ(view.at(639, 479), (479 + n) & 0xFFU);
    EXPECT_EQ(view.stride % 64, 0);
  }
}

TEST_F(IidcCamera, softwareTriggerFiresOncePerCall) {
  requested.trigger = CameraTrigger::software;
  c.configure(requested);
  EXPECT_EQ(c.camera->trigger_once(), DeviceStatus::stopped);
  ASSERT_EQ(c.camera->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(c.camera->trigger_once(), DeviceStatus::ok);
  EXPECT_EQ(c.bus->model().software_triggers, 1U);
  EXPECT_EQ(iidc::field(c.bus->command(iidc::reg::kTriggerMode), 23, 21),
            iidc::kTriggerSourceSoftware);
  CameraUnderTest free;
  free.start();
  EXPECT_EQ(free.camera->trigger_once(), DeviceStatus::unsupported);
}

TEST_F(IidcCamera, exposureSetWhileStreamingIsWrittenOrClamped) {
  ExposureSetting actual;
  c.configure();
  EXPECT_EQ(c.camera->set_exposure({Duration::milliseconds(2), 6}, &actual), DeviceStatus::stopped);
  ASSERT_EQ(c.camera->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(c.camera->set_exposure({Duration::milliseconds(2), 1e6}, &actual), DeviceStatus::ok);
  EXPECT_EQ(actual, (ExposureSetting{Duration::milliseconds(2), 24}));
  EXPECT_FLOAT_EQ(c.bus->model().shutter_abs, 0.002F);
  EXPECT_FLOAT_EQ(c.bus->model().gain_abs, 24.0F);
  EXPECT_EQ(c.camera->set_exposure({Duration::seconds(1), 0}, &actual),
            DeviceStatus::bad_configuration);
}

TEST_F(IidcCamera, framesAreCountedWithoutEmbeddedCounter) {
  c.start(CameraUnderTest::usual_with("embedded", "no"));
  c.bus->expose(3, Duration::milliseconds(100), {1});
  EXPECT_EQ(c.read_and_release().counter, 0U);
  const Frame f = c.read_and_release();
  EXPECT_EQ(f.counter, 1U);
  EXPECT_EQ(f.exposure_start.ns(), f.arrival.ns() - f.exposure.ns());
}

TEST_F(IidcCamera, timingIsExposureAndTransfer) {
  CameraUnderTest usb, bus(true);
  usb.configure();
  bus.configure();
  EXPECT_GT(usb.camera->timing().min_delay, usb.actual.exposure);
  // 75 packets of 4096 bytes, one in each cycle of 125 us.
  EXPECT_EQ(bus.camera->timing().min_delay, bus.actual.exposure + Duration::microseconds(75 * 125));
  EXPECT_LT(usb.camera->timing().resolution, Duration::microseconds(1));
}

}  // namespace
}  // namespace vergence::test
