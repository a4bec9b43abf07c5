// Own images through the V4L2 stack: numbered ones go into the outputs of looped test cameras, and
// every number has to come back.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <map>
#include <thread>

#include "drivers/v4l2/v4l2.hpp"
#include "tests/rigs/vivid.hpp"
#include "tests/support/camera_options.hpp"

namespace vergence::v4l2 {
namespace {

using test::VividPlayer;

constexpr int kWidth = test::width_of(test::LoopSize::vga);
constexpr int kHeight = test::height_of(test::LoopSize::vga);
constexpr std::int64_t kInterval_ns = 100'000'000;  // of an image: about six frames of the camera

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
    if (!std::filesystem::exists("/dev/video3"))
      GTEST_SKIP() << "no looped video nodes: this test runs inside the rig's kernel";
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

TEST_F(V4l2Loop, everyImageShownArrivesWholeInOrderAndInItsOwnCamera) {
  VividPlayer player({node(1), node(3)}, kInterval_ns, draw_number);
  std::unique_ptr<CameraDevice> cameras[2] = {streaming(0, configuration(59.94)),
                                              streaming(1, configuration(59.94))};
  std::int64_t newest[2] = {-1, -1};
  std::uint64_t frames[2] = {}, noise[2] = {}, skipped[2] = {};
  while (newest[0] < 40 && newest[1] < 40) {
    for (std::size_t k = 0; k < 2; ++k) {
      Frame frame;
      ASSERT_EQ(cameras[k]->wait(Duration::seconds(3), &frame), DeviceStatus::ok);
      const std::int64_t number = number_in(cameras[k]->view(frame.slot), k);
      cameras[k]->release(frame.slot);
      ++frames[k];
      if (number < 0) {
        ++noise[k];
        continue;
      }
      EXPECT_GE(number, newest[k]) << "camera " << k << ": an image from before";
      if (newest[k] >= 0 && number > newest[k] + 1)
        skipped[k] += static_cast<std::uint64_t>(number - newest[k] - 1);
      newest[k] = number;
    }
    ASSERT_LT(frames[0], 2000U);
  }
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(cameras[k]->statistics().torn, 0U);
    // Where the player came too late the test camera makes noise of its own; an image is missing
    // only with the frames it was shown in.
    const CameraStatistics s = cameras[k]->statistics();
    EXPECT_LE(skipped[k] * 4, s.lost + s.underruns + noise[k]) << "camera " << k;
    EXPECT_LT(noise[k], frames[k] / 4);
  }
}

TEST_F(V4l2Loop, thinnedCamerasSeeTheSameImagesAndEveryOne) {
  VividPlayer player({node(1), node(3)}, kInterval_ns, draw_number);
  CameraConfiguration c = configuration(10);
  test::give<v4l2::Options>(&c, "thin", "6");
  std::unique_ptr<CameraDevice> cameras[2] = {streaming(0, c), streaming(1, c)};
  // By the interval of the clock its exposure began in.
  std::map<std::int64_t, std::int64_t> seen[2];
  for (int i = 0; i < 40; ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      Frame frame;
      ASSERT_EQ(cameras[k]->wait(Duration::seconds(3), &frame), DeviceStatus::ok);
      seen[k][frame.exposure_start.ns() / kInterval_ns] =
          number_in(cameras[k]->view(frame.slot), k);
      cameras[k]->release(frame.slot);
    }
  int pairs = 0, equal = 0;
  std::int64_t last = -1;
  for (const auto& [interval, number] : seen[0]) {
    const auto other = seen[1].find(interval);
    if (other == seen[1].end() || interval == seen[0].begin()->first ||
        interval == seen[1].begin()->first)
      continue;
    ++pairs;
    equal += other->second == number && number >= 0 ? 1 : 0;
    if (last > 0 && number >= 0) {  // image 0 is there as soon as the player is
      EXPECT_GT(number, last) << "an image twice";
    }
    last = std::max(last, number);
  }
  EXPECT_GE(pairs, 34);
  EXPECT_GE(equal, pairs - 2) << "of " << pairs
                              << " pairs; the scheduler may hold the player up once";
}

TEST_F(V4l2Loop, aHeldImageKeepsItsPixelsWhileTheStreamGoesOn) {
  VividPlayer player({node(1), node(3)}, kInterval_ns, draw_number);
  auto camera = streaming(0, configuration(59.94));
  Frame held;
  std::int64_t number = -1;
  for (int i = 0; i < 200 && number < 0; ++i) {
    ASSERT_EQ(camera->wait(Duration::seconds(3), &held), DeviceStatus::ok);
    number = number_in(camera->view(held.slot), 0);
    if (number < 0) camera->release(held.slot);
  }
  ASSERT_GE(number, 0);
  for (int i = 0; i < 60; ++i) {
    Frame frame;
    ASSERT_EQ(camera->wait(Duration::seconds(3), &frame), DeviceStatus::ok);
    EXPECT_NE(frame.slot, held.slot);
    camera->release(frame.slot);
  }
  EXPECT_EQ(number_in(camera->view(held.slot), 0), number);
  camera->release(held.slot);
}

}  // namespace
}  // namespace vergence::v4l2
