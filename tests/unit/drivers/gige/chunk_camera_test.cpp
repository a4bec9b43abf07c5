#include "tests/support/camera_options.hpp"
#include "tests/unit/drivers/gige/gige_bench_rig.hpp"

namespace vergence::test {
namespace {

namespace reg = gige_register;

/// Longer than the registers say, by another amount each time.
double longer(std::uint64_t number, double us) {
  return us + 100.25 + 1.5 * static_cast<double>(number % 7);
}

GigeCameraOptions with_chunks() {
  GigeCameraOptions o;
  o.chunks = true;
  o.exposures = longer;
  return o;
}

TEST(GigeChunkCamera, everyFrameHadTheExposureThatItsChunkDataSay) {
  struct Case {
    std::uint32_t payload;
    bool old_names;
    const char* format;
  };
  for (const Case& c : {Case{0x4001, false, "Mono8"},
                        {5, true, "Mono8"},
                        {4, true, "Mono8"},
                        {0x4001, false, "Mono12"}}) {
    GigeCameraOptions o = with_chunks();
    o.chunk_payload = c.payload;
    o.old_names = c.old_names;
    if (std::string(c.format) == "Mono12") o.number_images = false;
    GigeBench b(o);
    CameraConfiguration wish = b.wish();
    wish.pixel_format = c.format;
    b.configure(wish);
    EXPECT_EQ(b.reg(reg::chunk_mode), 1U);
    EXPECT_GT(b.reg(reg::payload_size), 320U * 240 * (o.number_images ? 1 : 2));
    b.start();
    Frame frame;
    for (int i = 0; i < 15; ++i) {
      ASSERT_EQ(b.camera->wait(Duration::seconds(1), &frame), DeviceStatus::ok)
          << b.camera->last_error();
      EXPECT_EQ(frame.status, FrameStatus::complete);
      if (o.number_images) {
        const std::uint64_t number = b.number(frame);
        EXPECT_EQ(frame.exposure, Duration::seconds(b.simulator->exposed(number) * 1e-6))
            << c.payload;
        EXPECT_EQ(b.camera->view(frame.slot).at(319, 239), static_cast<std::uint8_t>(31 * number))
            << "the pixels are as they were";
      } else {  // converted: no number in it
        EXPECT_GE(frame.exposure, Duration::nanoseconds(2'100'250));
        EXPECT_LE(frame.exposure, Duration::nanoseconds(2'109'250));
      }
      b.camera->release(frame.slot);
    }
    EXPECT_EQ(b.camera->remark().find("chunk"), std::string::npos) << b.camera->remark();
  }
}

TEST(GigeChunkCamera, stampsOfTheEndGoBackByTheExposureThatWas) {
  GigeBench b(with_chunks());
  CameraConfiguration c = b.wish();
  test::give<gige::Options>(&c, "stamp_at", "end");
  b.configure(c);
  b.start();
  const auto frames = b.take(10);
  ASSERT_EQ(b.numbers.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    // Image n is exposed at n periods of 20 ms; a tick is 8 ns.
    const auto ticks =
        b.simulator->ticks(HostStamp(static_cast<std::int64_t>(b.numbers[i]) * 20'000'000));
    const Duration exposure = Duration::seconds(b.simulator->exposed(b.numbers[i]) * 1e-6);
    EXPECT_EQ(frames[i].exposure_start,
              DeviceStamp(static_cast<std::int64_t>(ticks) * 8) - exposure);
  }
}

TEST(GigeChunkCamera, withoutThemOrSwitchedOffTheExposureIsReckoned) {
  for (const bool off : {false, true}) {
    GigeCameraOptions o = with_chunks();
    o.chunks = off;
    GigeBench b(o);
    CameraConfiguration c = b.wish();
    if (off) {
      b.simulator->write(reg::chunk_mode, 1);  // as another program left it
      test::give<gige::Options>(&c, "chunks", "off");
    }
    b.configure(c);
    EXPECT_EQ(b.reg(reg::chunk_mode), 0U);
    EXPECT_EQ(b.reg(reg::payload_size), 320U * 240);
    b.start();
    const auto frames = b.take(5);
    ASSERT_EQ(frames.size(), 5U);
    for (const Frame& f : frames) EXPECT_EQ(f.exposure, Duration::milliseconds(2));
    EXPECT_EQ(b.camera->remark().find("chunk"), std::string::npos) << b.camera->remark();
  }
}

TEST(GigeChunkCamera, nonsenseInThemIsCountedAndTheFrameIsComplete) {
  GigeBench b(with_chunks());
  b.configure(b.wish());
  b.start();
  ASSERT_EQ(b.take(3).size(), 3U);
  b.simulator->garble_chunks(5);
  const std::size_t before = b.numbers.size();
  const auto frames = b.take(15);
  ASSERT_EQ(frames.size(), 15U);
  int reckoned = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].status, FrameStatus::complete);
    const bool told =
        frames[i].exposure == Duration::seconds(b.simulator->exposed(b.numbers[before + i]) * 1e-6);
    if (told) continue;
    ++reckoned;
    EXPECT_EQ(frames[i].exposure, Duration::milliseconds(2));
  }
  EXPECT_EQ(reckoned, 5);
  EXPECT_NE(b.camera->remark().find("5 images came without their exposure"), std::string::npos)
      << b.camera->remark();
}

TEST(GigeChunkCamera, imagesOfAnotherSizeAreNeverComplete) {
  for (const std::uint32_t payload : {0x4001U, 5U, 4U}) {
    for (const auto& [width, height] : {std::pair{160, 120}, {320, 238}, {640, 480}}) {
      GigeCameraOptions o = with_chunks();
      o.chunk_payload = payload;
      GigeBench b(o);
      b.configure(b.wish());
      b.start();
      ASSERT_EQ(b.take(3).size(), 3U);
      const std::uint64_t before = b.numbers.back();
      b.simulator->lie_about_size(width, height);
      (void)b.take(20);
      const std::size_t whole = b.numbers.size();
      EXPECT_LE(whole, 5U) << payload << ": " << width << " x " << height << " after image "
                           << before;
    }
  }
}

}  // namespace
}  // namespace vergence::test
