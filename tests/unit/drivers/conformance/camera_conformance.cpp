#include "tests/unit/drivers/conformance/camera_conformance.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "core/math/random.hpp"
#include "tests/rigs/emulator.hpp"
#include "tests/unit/drivers/conformance/shadow_camera.hpp"

namespace vergence::test {
namespace {

using State = ShadowCamera::State;

int asked_for(const char* name, int fallback) {
  const char* text = std::getenv(name);
  return text == nullptr ? fallback : std::atoi(text);
}

/// Requests that no camera supports.
std::vector<CameraConfiguration> nonsense(const CameraConfiguration& good) {
  std::vector<CameraConfiguration> all(6, good);
  all[0].width = 0;
  all[1].height = -480;
  all[2].rate_hz = 0;
  all[3].exposure = -good.exposure;
  // The exposure exceeds the frame interval.
  all[4].exposure = Duration::seconds(2 / good.rate_hz);
  all[5].width = 1'000'003;
  return all;
}

class CameraConformance : public ::testing::Test {
 protected:
  /// Null: the test was skipped.
  ConformanceRig* make(std::uint64_t seed) {
    // Only one such camera may exist at a time.
    rig_.reset();
    rig_ = make_conformance_rig(seed);
    return rig_.get();
  }
  std::unique_ptr<ConformanceRig> rig_;
};

TEST_F(CameraConformance, randomCallsKeepTheContract) {
  const int seeds = asked_for("VERGENCE_CONFORMANCE_SEEDS", 3),
            steps = asked_for("VERGENCE_CONFORMANCE_STEPS", 60);
  for (int seed = 1; seed <= seeds && !HasFailure(); ++seed) {
    if (make(static_cast<std::uint64_t>(seed)) == nullptr) GTEST_SKIP() << kNeedsRig;
    const auto possible = rig_->possible();
    auto impossible = nonsense(possible.front());
    for (const CameraConfiguration& c : rig_->impossible()) impossible.push_back(c);
    Random random(static_cast<std::uint64_t>(seed));
    const auto any_of = [&random](const auto& list) {
      return list[random.below(static_cast<std::uint32_t>(list.size()))];
    };
    ShadowCamera camera(rig_.get());
    // An unplug takes seconds, because cameras are given time to answer.
    int unplugs = 1;
    for (int step = 0; step < steps && !HasFailure(); ++step) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", step " + std::to_string(step));
      const std::uint32_t rule = random.below(100);
      const Duration period = Duration::seconds(1 / std::max(1.0, camera.configuration().rate_hz));
      if (rule < 6) {
        camera.configure(any_of(possible));
      } else if (rule < 12) {
        camera.refuse(any_of(impossible));
      } else if (rule < 24) {
        camera.start();
      } else if (rule < 29) {
        camera.stop();
      } else if (rule < 65) {
        const Duration limits[] = {Duration{}, Duration::milliseconds(1), period, period * 4};
        (void)camera.wait(limits[random.below(4)]);
      } else if (rule < 85) {
        if (camera.holds()) camera.release(random.below(static_cast<std::uint32_t>(camera.held())));
      } else if (rule < 92) {
        if (camera.state() == State::streaming) camera.expect_frames(3);
      } else if (rule < 94) {
        if (unplugs > 0 && camera.unplug_and_replug()) --unplugs;
      } else {
        camera.check_statistics();
      }
    }
    camera.release_all();
    camera.check_statistics();
  }
}

TEST_F(CameraConformance, invalidConfigurationChangesNothing) {
  if (make(11) == nullptr) GTEST_SKIP() << kNeedsRig;
  ShadowCamera camera(rig_.get());
  const auto possible = rig_->possible();
  for (const CameraConfiguration& c : nonsense(possible.front())) camera.refuse(c);
  // The camera is still not configured.
  camera.start();
  camera.configure(possible.front());
  for (const CameraConfiguration& c : nonsense(possible.front())) camera.refuse(c);
  for (const CameraConfiguration& c : rig_->impossible()) camera.refuse(c);
  camera.start();
  camera.expect_frames(3);
  // The streaming camera is busy.
  camera.configure(possible.back());
  camera.expect_frames(3);
  camera.check_statistics();
}

TEST_F(CameraConformance, newestIsDroppedAndCountedWithoutFreeSlot) {
  if (make(14) == nullptr) GTEST_SKIP() << kNeedsRig;
  ShadowCamera camera(rig_.get());
  camera.configure(rig_->possible().front());
  camera.start();
  camera.expect_frames(1);
  const std::uint64_t before = rig_->camera().statistics().underruns;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  std::uint64_t dropped = 0;
  while (dropped < 3 && std::chrono::steady_clock::now() < deadline && !HasFatalFailure()) {
    const DeviceStatus status = camera.wait(Duration::milliseconds(100));
    ASSERT_TRUE(status == DeviceStatus::ok || status == DeviceStatus::timeout) << to_string(status);
    dropped = rig_->camera().statistics().underruns - before;
  }
  ASSERT_GE(dropped, 3U) << "with " << camera.held() << " slots out nothing was dropped";
  EXPECT_LE(camera.held(), FramePool::kMaxSlots);
  camera.release_all();
  camera.expect_frames(6);
  EXPECT_GE(camera.gaps(), 3U);
  camera.check_statistics();
}

TEST_F(CameraConformance, exposuresThatNeverArriveAreCounted) {
  if (make(15) == nullptr) GTEST_SKIP() << kNeedsRig;
  ShadowCamera camera(rig_.get());
  camera.configure(rig_->possible().front());
  camera.start();
  camera.expect_frames(5);
  const std::uint64_t gaps = camera.gaps();
  const CameraStatistics before = rig_->camera().statistics();
  // This rig cannot lose frames.
  if (!rig_->lose(4)) return;
  camera.expect_frames(12);
  const CameraStatistics after = rig_->camera().statistics();
  EXPECT_EQ(camera.gaps() - gaps, 4 + after.underruns - before.underruns);
  EXPECT_EQ(after.lost - before.lost, 4U);
}

/// Frames until one has that setting; false: none of the next had.
bool reaches(ConformanceRig& rig, const CameraConfiguration& c, const ExposureSetting& setting) {
  // Limit for an exposure in progress and for buffers in the camera and in transit.
  constexpr int kFrames = 12;
  for (int i = 0; i < kFrames; ++i) {
    if (c.trigger == CameraTrigger::software) (void)rig.camera().trigger_once();
    Frame frame;
    if (rig.camera().wait(Duration::seconds(2), &frame) != DeviceStatus::ok) return false;
    rig.camera().release(frame.slot);
    if (frame.exposure == setting.exposure && frame.gain_db == setting.gain_db) return true;
  }
  return false;
}

TEST_F(CameraConformance, exposureSetWhileStreamingPersists) {
  if (make(18) == nullptr) GTEST_SKIP() << kNeedsRig;
  CameraDevice& camera = rig_->camera();
  const auto c = rig_->possible().front();
  ASSERT_EQ(camera.configure(c, nullptr), DeviceStatus::ok) << camera.last_error();
  const std::vector<ExposureSetting> settings = rig_->exposures();
  ExposureSetting actual;
  if (settings.empty()) {
    ASSERT_EQ(camera.start(nullptr), DeviceStatus::ok) << camera.last_error();
    EXPECT_EQ(camera.set_exposure({c.exposure, c.gain_db}, &actual), DeviceStatus::unsupported);
    return;
  }
  EXPECT_EQ(camera.set_exposure(settings[0], &actual), DeviceStatus::stopped);
  ASSERT_EQ(camera.start(nullptr), DeviceStatus::ok) << camera.last_error();
  rig_->started();
  EXPECT_TRUE(reaches(*rig_, c, {c.exposure, c.gain_db})) << "as configured";
  EXPECT_EQ(camera.set_exposure({-c.exposure, 0}, &actual), DeviceStatus::bad_configuration);
  EXPECT_EQ(camera.set_exposure({Duration::seconds(2 / c.rate_hz), 0}, &actual),
            DeviceStatus::bad_configuration);
  for (const ExposureSetting& s : settings) {
    ASSERT_EQ(camera.set_exposure(s, &actual), DeviceStatus::ok) << camera.last_error();
    EXPECT_EQ(actual, s);
    EXPECT_TRUE(reaches(*rig_, c, s));
  }
  // Beyond what it has: the nearest.
  ASSERT_EQ(camera.set_exposure({settings[0].exposure, 1e6}, &actual), DeviceStatus::ok)
      << camera.last_error();
  EXPECT_LT(actual.gain_db, 1e6);
  EXPECT_TRUE(reaches(*rig_, c, actual));
  camera.stop();
  ASSERT_EQ(camera.start(nullptr), DeviceStatus::ok) << camera.last_error();
  EXPECT_TRUE(reaches(*rig_, c, actual));
  camera.stop();
}

TEST_F(CameraConformance, unpluggedCameraIsDisconnectedAndReturns) {
  if (make(16) == nullptr) GTEST_SKIP() << kNeedsRig;
  ShadowCamera camera(rig_.get());
  camera.configure(rig_->possible().front());
  camera.start();
  camera.expect_frames(3);
  if (!camera.unplug_and_replug()) return;
  camera.expect_frames(5);
  camera.release_all();
  camera.check_statistics();
}

TEST_F(CameraConformance, threeThreadsMayShareACamera) {
  if (make(17) == nullptr) GTEST_SKIP() << kNeedsRig;
  CameraDevice& camera = rig_->camera();
  const auto configuration = rig_->possible().front();
  ASSERT_EQ(camera.configure(configuration, nullptr), DeviceStatus::ok) << camera.last_error();
  std::mutex mutex;
  std::vector<FrameSlot> back;
  std::atomic<bool> over{false};
  std::atomic<int> frames{0};
  std::thread consumer([&] {
    for (Frame frame; !over;) {
      const DeviceStatus status = camera.wait(Duration::seconds(30), &frame);
      if (status == DeviceStatus::stopped)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (status != DeviceStatus::ok) continue;
      ++frames;
      const std::lock_guard lock(mutex);
      back.push_back(frame.slot);
    }
  });
  std::thread releaser([&] {
    for (bool last = false;;) {
      std::vector<FrameSlot> mine;
      {
        const std::lock_guard lock(mutex);
        mine.swap(back);
      }
      for (const FrameSlot slot : mine) camera.release(slot);
      if (last) break;
      last = over;
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
  });
  CountingNotifier notifier;
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(camera.start(&notifier), DeviceStatus::ok) << camera.last_error();
    rig_->started();
    for (int k = 0; k < 10; ++k) {
      if (configuration.trigger == CameraTrigger::software) (void)camera.trigger_once();
      std::this_thread::sleep_for(std::chrono::milliseconds(15));
      (void)camera.statistics();
    }
    camera.stop();
  }
  over = true;
  const auto stopped = std::chrono::steady_clock::now();
  consumer.join();
  EXPECT_LT(std::chrono::steady_clock::now() - stopped, std::chrono::seconds(2))
      << "stop() did not wake wait()";
  {
    // The releaser's last round may have been before the last frame.
    const std::lock_guard lock(mutex);
  }
  releaser.join();
  for (const FrameSlot slot : back) camera.release(slot);
  EXPECT_GT(frames, 6);
  EXPECT_EQ(camera.statistics().delivered, static_cast<std::uint64_t>(frames.load()));
  EXPECT_EQ(camera.statistics().starts, 6U);
}

}  // namespace
}  // namespace vergence::test
