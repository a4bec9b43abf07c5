
#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/iidc/camera_under_test.hpp"

namespace vergence::test {
namespace {

using namespace iidc;

void expect_mentions(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_TRUE(mentions(message, part));
}

using IidcConfigure = WithCamera;

TEST_F(IidcConfigure, fixedModeServesItsOwnSizeAndRate) {
  requested.rate_hz = 30;
  c.configure(requested);
  EXPECT_EQ(c.bus->command(reg::kVideoFormat), 0U << 29U);
  EXPECT_EQ(c.bus->command(reg::kVideoMode), 5U << 29U);
  EXPECT_EQ(c.bus->command(reg::kFrameRate), 4U << 29U);
  EXPECT_EQ(c.actual.rate_hz, 30);
  EXPECT_EQ(c.actual.pixel_format, "Mono8");
  EXPECT_EQ(c.bus->shape().packet_bytes, 1280U);
  EXPECT_EQ(c.bus->shape().frame_bytes, 640U * 480U);
}

TEST_F(IidcConfigure, triggersUseTheNextHigherFixedRate) {
  requested.rate_hz = 20;
  requested.trigger = CameraTrigger::hardware;
  c.configure(requested);
  // The rate code is that of 30 Hz.
  EXPECT_EQ(c.bus->command(reg::kFrameRate), 4U << 29U);
  EXPECT_EQ(c.actual.rate_hz, 20);
  EXPECT_EQ(c.bus->command(reg::kTriggerMode) | bit(31),
            (TriggerMode{.on = true, .rising = true, .source = 0, .mode = 14}.quadlet()));
  EXPECT_FALSE(FeatureValue::of(c.bus->command(reg::feature_value(Feature::frame_rate))).on);
}

TEST_F(IidcConfigure, otherRateOrRegionUsesFormat7) {
  requested.width = 320;
  requested.height = 240;
  requested.offset_x = 64;
  requested.offset_y = 32;
  c.configure(requested);
  EXPECT_EQ(c.bus->command(reg::kVideoFormat), 7U << 29U);
  EXPECT_EQ(c.bus->model().f7_size, 320U << 16U | 240U);
  EXPECT_EQ(c.bus->model().f7_position, 64U << 16U | 32U);
  EXPECT_GE(c.bus->model().f7_packet, packet_for_rate(320 * 240, 10, 4, 4096));
  EXPECT_NEAR(c.actual.rate_hz, 10, 1e-6);
  EXPECT_NEAR(iidc_rate(&c.bus->model()), 10, 0.1);
  EXPECT_GE(c.bus->shape().frame_bytes, 320U * 240U);
  EXPECT_EQ(c.bus->command(reg::kTriggerMode) & bit(25), 0U) << "off";
}

TEST_F(IidcConfigure, packetIsTheCamerasShareOfTheBus) {
  CameraUnderTest bus(true), usb;
  for (const int cameras : {1, 2, 3}) {
    CameraConfiguration asked = CameraUnderTest::usual();
    asked.sharing = cameras;
    bus.configure(asked);
    const std::size_t packet = bus.bus->shape().packet_bytes,
                      share = kBandwidthUnits / static_cast<unsigned>(cameras);
    EXPECT_LE(bandwidth_units(packet, BusSpeed::s400), share);
    if (packet < 4096) {
      EXPECT_GT(bandwidth_units(packet + 4, BusSpeed::s400), share);
    }
    usb.configure(asked);
    EXPECT_LE(static_cast<double>(usb.bus->shape().packet_bytes) * kCyclesPerSecond * cameras,
              33e6);
  }
  CameraConfiguration asked = CameraUnderTest::usual_with("packet_bytes", "1024");
  bus.configure(asked);
  EXPECT_EQ(bus.bus->model().f7_packet, 1024U);
}

TEST_F(IidcConfigure, rateByPacketsUsesTheSmallestPacket) {
  CameraUnderTest own(true);
  own.bus->masked[kRegisterSpace + 0xF00000 + reg::feature_inquiry(Feature::frame_rate)] = 0;
  own.configure();
  EXPECT_EQ(own.bus->model().f7_packet, packet_for_rate(640 * 480, 10 * 0.99, 4, 4096));
  EXPECT_NEAR(own.actual.rate_hz, 10, 0.1);
}

TEST_F(IidcConfigure, regionChangeStaysOnTheSensor) {
  requested.width = 320;
  requested.height = 240;
  requested.offset_x = 960;
  requested.offset_y = 720;
  c.configure(requested);
  requested.width = 1280;
  requested.height = 960;
  requested.offset_x = requested.offset_y = 0;
  requested.rate_hz = 5;
  c.configure(requested);
  std::uint32_t x = 0, width = 640;
  for (const auto& [address, value] : c.bus->written) {
    if (address == kRegisterSpace + 0xF08008) x = value >> 16U;
    if (address == kRegisterSpace + 0xF0800C) width = value >> 16U;
    EXPECT_LE(x + width, 1280U);
  }
}

TEST_F(IidcConfigure, exposureAndGainAreAbsoluteAndReadBack) {
  requested.exposure = Duration::microseconds(1234);
  requested.gain_db = 6.5;
  c.configure(requested);
  EXPECT_FLOAT_EQ(c.bus->model().shutter_abs, 0.001234F);
  EXPECT_FLOAT_EQ(c.bus->model().gain_abs, 6.5F);
  EXPECT_NEAR(c.actual.exposure.to_seconds(), 0.001234, 1e-9);
  const FeatureValue v = FeatureValue::of(c.bus->command(reg::feature_value(Feature::shutter)));
  EXPECT_TRUE(v.absolute && v.on);
  EXPECT_FALSE(v.automatic);
}

TEST_F(IidcConfigure, embeddedStampAndCounterAreEnabled) {
  c.configure();
  EXPECT_EQ(c.bus->model().frame_info, 0x41U);
  EXPECT_EQ(c.camera->plan().info.size(), 8U);
  EXPECT_TRUE(c.camera->remark().empty());
  c.configure(CameraUnderTest::usual_with("embedded", "no"));
  EXPECT_EQ(c.bus->model().frame_info, 0U);
  expect_mentions(c.camera->remark(), {"embeds no counter"});
}

TEST_F(IidcConfigure, strobeAndTriggerOptionsAreWritten) {
  requested.trigger = CameraTrigger::hardware;
  requested.options = Options{.trigger_mode = 0,
                              .trigger_source = 1,
                              .trigger_rising = false,
                              .strobe_pin = 2,
                              .strobe_high = false,
                              .strobe_delay = Duration::milliseconds(1),
                              .strobe_duration = Duration::milliseconds(2)};
  c.configure(requested);
  EXPECT_EQ(c.bus->model().strobe[2] | bit(31),
            (StrobeControl{.on = true, .high = false, .delay = 1024, .duration = 2048}.quadlet()));
  EXPECT_EQ(c.bus->command(reg::kTriggerMode) | bit(31),
            (TriggerMode{.on = true, .rising = false, .source = 1, .mode = 0}.quadlet()));
}

TEST_F(IidcConfigure, busSpeedIsTheCamerasHighest) {
  CameraUnderTest legacy(true, false), beta(true, true);
  legacy.configure();
  EXPECT_EQ(legacy.bus->model().iso_speed, 2U);
  beta.configure();
  EXPECT_EQ(beta.bus->model().iso_speed, 3U);
  CameraConfiguration asked = CameraUnderTest::usual_with("speed", "800");
  std::string said;
  EXPECT_EQ(legacy.refuse(asked, &said), DeviceStatus::unsupported);
  expect_mentions(said, {"speed", "S400"});
  test::give<iidc::Options>(&asked, "speed", "400");
  beta.configure(asked);
  EXPECT_EQ(beta.bus->model().iso_speed, 2U);
}

TEST_F(IidcConfigure, largePacketIsUsedOnlyWithoutSmallerOne) {
  requested.width = 1280;
  requested.height = 960;
  requested.rate_hz = 30;
  CameraUnderTest own(true, true);
  own.configure(requested);
  EXPECT_EQ(own.bus->shape().packet_bytes, 5120U) << "alone: the fixed mode";
  requested.sharing = 2;
  own.configure(requested);
  EXPECT_EQ(own.bus->command(reg::kVideoFormat), 7U << 29U);
  EXPECT_LE(2 * bandwidth_units(own.bus->shape().packet_bytes, BusSpeed::s800), kBandwidthUnits);
  EXPECT_NEAR(own.actual.rate_hz, 30, 0.3);
  test::give<iidc::Options>(&requested, "format7", "no");
  own.configure(requested);
  EXPECT_EQ(own.bus->shape().packet_bytes, 5120U);
}

TEST_F(IidcConfigure, refusalNamesWhatTheCameraOffers) {
  using C = CameraConfiguration;
  struct Refusal {
    void (*change)(C*);
    std::initializer_list<const char*> mentions;
    DeviceStatus status = DeviceStatus::unsupported;
  };
  CameraUnderTest own(true);
  own.configure();
  own.bus->written.clear();
  for (const Refusal& r : {
           Refusal{[](C* w) { w->width = 641; },
                   {"641 x 480", "640 x 480 Mono8 at", "1280 x 960 in steps of 8 x 2"}},
           Refusal{[](C* w) { w->width = 1280, w->height = 960, w->rate_hz = 30; },
                   // The limit is that of S400.
                   {"packets of 4096 bytes", "26.58 Hz"}},
           Refusal{[](C* w) { w->exposure = Duration::microseconds(3); },
                   {"3 us", "10 to 100000 us"}},
           Refusal{[](C* w) { w->gain_db = 30; }, {"30 dB", "0 to 24 dB"}},
           Refusal{[](C* w) { w->pixel_format = "RGB8"; }, {"RGB8", "Mono8 Mono16 Raw8"}},
           Refusal{[](C* w) {
                     w->trigger = CameraTrigger::hardware;
                     w->options = Options{.trigger_source = 3};
                   },
                   {"input 3", "inputs 0 1", "software", "modes 0 14 15"}},
           Refusal{[](C* w) { w->options = v4l2::Options{}; }, {"another kind of camera", "IIDC"}},
           Refusal{[](C* w) { w->options = Options{.packet_bytes = 1022}; },
                   {"packet_bytes", "steps of 4"}},
           Refusal{[](C* w) { w->options = Options{.packet_bytes = 256}, w->rate_hz = 25; },
                   {"packets of 256 bytes"}},
           Refusal{[](C* w) { w->exposure = Duration::milliseconds(150); },
                   {"150000 us"},
                   DeviceStatus::bad_configuration},
       }) {
    CameraConfiguration asked = CameraUnderTest::usual();
    r.change(&asked);
    std::string said;
    EXPECT_EQ(own.refuse(asked, &said), r.status) << said;
    expect_mentions(said, r.mentions);
  }
  EXPECT_TRUE(own.bus->written.empty()) << "a refusal writes nothing";
  EXPECT_EQ(own.camera->start(nullptr), DeviceStatus::ok);
}

}  // namespace
}  // namespace vergence::test
