// Own images through the V4L2 stack: numbered ones go into the outputs of looped test cameras, and
// every number has to come back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "drivers/v4l2/v4l2.hpp"
#include "tests/rigs/emulator.hpp"
#include "tests/rigs/vivid.hpp"
#include "tests/support/camera_options.hpp"

namespace vergence::v4l2 {
namespace {

using test::VividPlayer;

constexpr int kWidth = test::width_of(test::LoopSize::vga);
constexpr int kHeight = test::height_of(test::LoopSize::vga);
/// Interval of an image, which is about six frames of the camera.
constexpr std::int64_t kInterval_ns = 100'000'000;

/// The number at the start of every row, with the output's; a level that follows from it elsewhere.
void draw_number(std::size_t output, std::uint64_t number, std::span<std::uint8_t> image) {
  std::fill(image.begin(), image.end(), static_cast<std::uint8_t>(number * 7 + output * 128));
  const std::uint64_t mark = number << 8U | output;
  for (int y = 0; y < kHeight; ++y) std::memcpy(image.data() + y * kWidth, &mark, sizeof mark);
}

/// The number in an image of that output; −1: rows of several images, or another output's.
std::int64_t number_in(const ImageView& view, std::size_t output) {
  std::uint64_t mark = 0;
  std::memcpy(&mark, view.row(0), sizeof mark);
  if ((mark & 0xFFU) != output) return -1;
  std::vector<std::uint8_t> expected(static_cast<std::size_t>(kWidth) * kHeight);
  draw_number(output, mark >> 8U, expected);
  for (int y = 0; y < kHeight; ++y)
    if (std::memcmp(view.row(y), expected.data() + y * kWidth, kWidth) != 0) return -1;
  return static_cast<std::int64_t>(mark >> 8U);
}

class V4l2Loop : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::inside_rig()) GTEST_SKIP() << test::kNeedsRig;
    for (int k = 0; k < 2; ++k) test::loop(node(2 * k), node(2 * k + 1));
  }
  static std::string node(int number) { return "/dev/video" + std::to_string(number); }
  static CameraConfiguration configuration(double rate_hz) {
    CameraConfiguration c{kWidth, kHeight, rate_hz, Duration::milliseconds(5)};
    c.trigger = CameraTrigger::free;
    test::give<v4l2::Options>(&c, "control_timestamp_source", "Start of Exposure");
    return c;
  }
  std::unique_ptr<CameraDevice> streaming(int k, const CameraConfiguration& c) {
    DeviceStatus status = DeviceStatus::failed;
    auto camera = driver_->open(node(2 * k), &status);
    EXPECT_EQ(status, DeviceStatus::ok);
    EXPECT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
    EXPECT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
    return camera;
  }
  std::unique_ptr<CameraDriver> driver_ = make_driver();
};

/// A frame that a thinned camera kept.
struct Kept {
  std::int64_t number = 0;
  /// The image was copied between these times.
  std::int64_t from_ns = 0, until_ns = 0;
  /// Interval of the clock in which the exposure began.
  std::int64_t interval = 0;
};

/// The numbers that an output showed while a frame was copied: the first and the last.
std::pair<std::int64_t, std::int64_t> shown_to(const Kept& frame, const VividPlayer& player,
                                               std::size_t output) {
  std::pair<std::int64_t, std::int64_t> all{std::numeric_limits<std::int64_t>::max(), -2};
  for (const VividPlayer::Showing& s : player.showings(output))
    if (s.from_ns <= frame.until_ns && s.until_ns >= frame.from_ns)
      all = {std::min(all.first, s.number), std::max(all.second, s.number)};
  return all;
}

TEST_F(V4l2Loop, decimatedCamerasDeliverEveryLoopedImage) {
  constexpr int kFrames = 40;
  VividPlayer player({node(1), node(3)}, kInterval_ns, draw_number);
  CameraConfiguration c = configuration(10);
  test::give<v4l2::Options>(&c, "thin", "6");
  std::unique_ptr<CameraDevice> cameras[2] = {streaming(0, c), streaming(1, c)};
  std::vector<Kept> kept[2];
  for (int i = 0; i < kFrames; ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      Frame frame;
      ASSERT_EQ(cameras[k]->wait(Duration::seconds(3), &frame), DeviceStatus::ok);
      kept[k].push_back({number_in(cameras[k]->view(frame.slot), k), frame.exposure_start.ns(),
                         frame.arrival.ns(), frame.exposure_start.ns() / kInterval_ns});
      cameras[k]->release(frame.slot);
    }
  player.stop();
  for (std::size_t k = 0; k < 2; ++k) {
    const CameraStatistics s = cameras[k]->statistics();
    const std::int64_t intervals = kept[k].back().interval - kept[k].front().interval + 1;
    EXPECT_LE(intervals - kFrames, static_cast<std::int64_t>(s.lost + s.underruns))
        << "camera " << k << ": an interval of which a frame came, and none was kept";
    for (std::size_t i = 0; i < kept[k].size(); ++i) {
      const auto [first, last] = shown_to(kept[k][i], player, k);
      EXPECT_LE(first, kept[k][i].number) << "camera " << k << ", frame " << i;
      EXPECT_GE(last, kept[k][i].number) << "camera " << k << ", frame " << i;
      if (i > 0) {
        EXPECT_GT(kept[k][i].interval, kept[k][i - 1].interval) << "an interval twice";
      }
    }
  }
}

}  // namespace
}  // namespace vergence::v4l2
