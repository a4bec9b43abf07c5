#include "drivers/common/side_by_side_camera.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <deque>
#include <set>

#include "tests/support/idle_camera.hpp"

namespace vergence {
namespace {

// Size of one image.
constexpr int kWidth = 8, kHeight = 2;

/// A camera that gives what the test puts into it.
class ScriptedCamera final : public test::IdleCamera {
 public:
  struct Script {
    // Results of wait(), followed by `timeout`.
    std::deque<DeviceStatus> answers;
    std::set<FrameSlot> held;
    int starts = 0;
    DeviceStatus on_start = DeviceStatus::ok;
  };
  explicit ScriptedCamera(Script* script) : script_(script) {
    for (std::size_t i = 0; i < pixels_.size(); ++i) pixels_[i] = static_cast<std::uint8_t>(i);
  }

  DeviceStatus start(Notifier*) noexcept override {
    ++script_->starts;
    return script_->on_start;
  }
  DeviceStatus wait(Duration, Frame* frame) noexcept override {
    if (script_->answers.empty()) return DeviceStatus::timeout;
    const DeviceStatus status = script_->answers.front();
    script_->answers.pop_front();
    frame->arrival = HostStamp(7'000'000);
    if (status != DeviceStatus::ok) return status;
    frame->slot = static_cast<FrameSlot>(next_ % 4);
    frame->counter = next_++;
    EXPECT_TRUE(script_->held.insert(frame->slot).second) << "a slot that is still held";
    return status;
  }
  ImageView view(FrameSlot) const noexcept override {
    return {pixels_.data(), 2 * kWidth, kHeight, 2 * kWidth};
  }
  void release(FrameSlot slot) noexcept override {
    EXPECT_EQ(script_->held.erase(slot), 1U) << "a slot that is not held";
  }
  CameraStatistics statistics() const noexcept override { return {99, 98, 3, 2, 1}; }

 private:
  Script* script_;
  std::array<std::uint8_t, 2 * kWidth * kHeight> pixels_{};
  std::uint64_t next_ = 0;
};

class SideBySide : public ::testing::Test {
 protected:
  void SetUp() override {
    std::tie(left_, right_) = split_side_by_side(std::make_unique<ScriptedCamera>(&script_));
  }
  void stream() {
    ASSERT_EQ(left_->configure(asked_, nullptr), DeviceStatus::ok);
    ASSERT_EQ(right_->configure(asked_, nullptr), DeviceStatus::ok);
    ASSERT_EQ(left_->start(nullptr), DeviceStatus::ok);
    ASSERT_EQ(right_->start(nullptr), DeviceStatus::ok);
  }

  ScriptedCamera::Script script_;
  std::unique_ptr<CameraDevice> left_, right_;
  CameraConfiguration asked_{kWidth, kHeight, 30};
};

TEST_F(SideBySide, bothSidesComeFromOneExposure) {
  stream();
  script_.answers = {DeviceStatus::ok, DeviceStatus::ok};
  std::array<Frame, 2> left{}, right{};
  for (Frame& f : left) ASSERT_EQ(left_->wait({}, &f), DeviceStatus::ok);
  for (Frame& f : right) ASSERT_EQ(right_->wait({}, &f), DeviceStatus::ok);
  EXPECT_EQ(left_->wait({}, left.data()), DeviceStatus::timeout);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(left[i].counter, i);
    EXPECT_EQ(right[i].counter, i);
    EXPECT_EQ(right[i].exposure_start, left[i].exposure_start);
    EXPECT_EQ(right[i].slot, left[i].slot);
  }
  const ImageView a = left_->view(left[0].slot), b = right_->view(right[0].slot);
  EXPECT_EQ(a.width, kWidth);
  EXPECT_EQ(b.width, kWidth);
  EXPECT_EQ(a.height, kHeight);
  EXPECT_EQ(b.row(0), a.row(0) + kWidth);
  EXPECT_EQ(*b.row(1), 3 * kWidth) << "the picture's second row, its right half";
}

TEST_F(SideBySide, slotIsReleasedWhenBothHaveReleasedIt) {
  stream();
  script_.answers = {DeviceStatus::ok};
  Frame left, right;
  ASSERT_EQ(right_->wait({}, &right), DeviceStatus::ok);
  ASSERT_EQ(left_->wait({}, &left), DeviceStatus::ok);
  left_->release(left.slot);
  EXPECT_EQ(script_.held.size(), 1U);
  EXPECT_EQ(left_->configure(asked_, nullptr), DeviceStatus::busy);
  right_->release(right.slot);
  EXPECT_TRUE(script_.held.empty());
}

TEST_F(SideBySide, stopReleasesUntakenFrames) {
  stream();
  script_.answers = {DeviceStatus::ok, DeviceStatus::ok};
  Frame frame;
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::ok);
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::ok);
  left_->stop();
  EXPECT_EQ(script_.held.size(), 2U) << "the left ones are held";
  left_->release(0);
  left_->release(1);
  EXPECT_TRUE(script_.held.empty());
}

TEST_F(SideBySide, bothAreDisconnectedBeforeEitherReturns) {
  stream();
  script_.answers = {DeviceStatus::ok, DeviceStatus::disconnected};
  Frame frame;
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::ok);
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::disconnected);
  EXPECT_EQ(frame.arrival, HostStamp(7'000'000));
  const int starts = script_.starts;
  EXPECT_EQ(left_->start(nullptr), DeviceStatus::disconnected)
      << "the right half does not know yet";
  EXPECT_EQ(script_.starts, starts);
  ASSERT_EQ(right_->wait({}, &frame), DeviceStatus::ok) << "what came before it went";
  ASSERT_EQ(right_->wait({}, &frame), DeviceStatus::disconnected);
  script_.on_start = DeviceStatus::disconnected;
  EXPECT_EQ(left_->start(nullptr), DeviceStatus::disconnected);
  EXPECT_EQ(right_->start(nullptr), DeviceStatus::disconnected);
  script_.on_start = DeviceStatus::ok;
  EXPECT_EQ(right_->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(left_->start(nullptr), DeviceStatus::ok);
  script_.answers = {DeviceStatus::ok};
  EXPECT_EQ(left_->wait({}, &frame), DeviceStatus::ok);
  EXPECT_EQ(right_->wait({}, &frame), DeviceStatus::ok);
}

TEST_F(SideBySide, secondDisconnectDuringReturnRecovers) {
  stream();
  script_.answers = {DeviceStatus::disconnected};
  Frame frame;
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::disconnected);
  ASSERT_EQ(right_->wait({}, &frame), DeviceStatus::disconnected);
  ASSERT_EQ(left_->start(nullptr), DeviceStatus::ok);
  script_.answers = {DeviceStatus::disconnected};
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::disconnected);
  ASSERT_EQ(right_->start(nullptr), DeviceStatus::ok);
  ASSERT_EQ(left_->start(nullptr), DeviceStatus::ok);
  script_.answers = {DeviceStatus::ok};
  EXPECT_EQ(left_->wait({}, &frame), DeviceStatus::ok);
}

TEST_F(SideBySide, countOwnFramesAndSharedLosses) {
  stream();
  script_.answers = {DeviceStatus::ok};
  Frame frame;
  ASSERT_EQ(left_->wait({}, &frame), DeviceStatus::ok);
  EXPECT_EQ(left_->statistics().delivered, 1U);
  EXPECT_EQ(right_->statistics().delivered, 0U);
  EXPECT_EQ(right_->statistics().lost, 2U);
  EXPECT_EQ(right_->statistics().underruns, 3U);
}

}  // namespace
}  // namespace vergence
