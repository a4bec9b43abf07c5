#include "app/devices/exposure_control.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "drivers/mock/mock_rig.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr double kRate = 20;

const std::shared_ptr<const mock::World>& town() {
  static const auto world = [] {
    mock::WorldOptions o;
    o.texture_detail = 0;
    return std::make_shared<const mock::World>(o);
  }();
  return world;
}

/// What one camera handed out, by its counter.
struct Shown {
  ExposureSetting had;
  double mean = 0;  // grey
  bool operator==(const Shown&) const = default;
};

/// A drive through faults with the cameras under control, in virtual time.
struct Driven {
  std::array<std::map<std::uint64_t, Shown>, 2> cameras;
  ExposureCounters counters;
};

Driven drive(const std::vector<std::string>& faults, int latency, double seconds) {
  RigCalibration rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k) {
    rig.intrinsics[k].width = kWidth;
    rig.intrinsics[k].height = kHeight;
    rig.intrinsics[k].fx = rig.intrinsics[k].fy = 70;
    rig.intrinsics[k].cx = 47.5;
    rig.intrinsics[k].cy = 31.5;
  }
  rig.T_camera_left[1].t = {-0.75, 0, 0};
  std::vector<mock::Fault> parsed;
  for (const std::string& f : faults) parsed.push_back(mock::parse_fault(f));
  mock::DriveOptions way;
  way.kind = mock::DriveKind::still;
  mock::MockRigOptions o;
  o.duration = Duration::seconds(seconds);
  o.exposures_follow = true;
  o.exposure_latency = latency;
  mock::MockRig mock(std::make_shared<const mock::RigTruth>(
                         town(), way, rig, mock::default_T_body_left(), Transform{}, parsed),
                     o);
  const exposure::ExposureOptions options;
  const ExposureSetting start{Duration::microseconds(4000), 0};
  for (int k = 0; k < 2; ++k)
    EXPECT_EQ(
        mock.camera(k).configure({kWidth, kHeight, kRate, start.exposure, start.gain_db}, nullptr),
        DeviceStatus::ok);
  ExposureControl control({&mock.camera(0), &mock.camera(1)}, kWidth, kHeight, {}, options, start,
                          true);
  const std::vector<CameraDevice*> cameras = control.cameras();
  for (CameraDevice* camera : cameras) EXPECT_EQ(camera->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(mock.trigger().configure({kRate}, nullptr), DeviceStatus::ok);
  EXPECT_EQ(mock.trigger().start(nullptr), DeviceStatus::ok);
  const exposure::BrightnessMeter meter(kWidth, kHeight, {});
  Driven driven;
  for (int ended = 0; ended < 2;) {
    ended = 0;
    bool any = false;
    for (std::size_t k = 0; k < 2; ++k) {
      Frame frame;
      const DeviceStatus status = cameras[k]->wait({}, &frame);
      ended += status == DeviceStatus::ended ? 1 : 0;
      if (status != DeviceStatus::ok) continue;
      any = true;
      driven.cameras[k][frame.counter] = {{frame.exposure, frame.gain_db},
                                          meter.measure(cameras[k]->view(frame.slot), 0).mean};
      cameras[k]->release(frame.slot);
    }
    if (!any) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  for (CameraDevice* camera : cameras) camera->stop();
  control.settle();
  driven.counters = control.counters();
  return driven;
}

int changes_between(const Driven& d, std::uint64_t first, std::uint64_t last) {
  int n = 0;
  for (std::uint64_t i = first + 1; i < last; ++i)
    n += d.cameras[0].at(i).had == d.cameras[0].at(i - 1).had ? 0 : 1;
  return n;
}

/// Images from the one at which an exposure is asked for to the first that has it.
class ExposureOnTheMock : public ::testing::TestWithParam<int> {};

TEST_P(ExposureOnTheMock,
       nightCoverAndALampAreFollowedAtRestWithinThreeSecondsAndAlikeInBothCameras) {
  // Night, an eighth of the light, from 4 to 10 s; both lenses covered from 14 to 16 s; a lamp,
  // four times the light, from 20 to 25 s.
  const Driven d = drive({"night@4 duration_s=6 factor=0.125", "cover@14 duration_s=2",
                          "exposure@20 duration_s=5 factor=4"},
                         GetParam(), 29);
  ASSERT_EQ(d.cameras[0].size(), 581U);
  ASSERT_EQ(d.cameras[1].size(), 581U);
  for (const auto& [counter, shown] : d.cameras[0])
    EXPECT_EQ(shown.had, d.cameras[1].at(counter).had) << "pulse " << counter;
  EXPECT_EQ(d.counters.refused + d.counters.unequal + d.counters.again, 0U);
  const exposure::ExposureOptions o;
  // Images: three stops up one at a time and a correction, each after settle_frames and the
  // latency, come to 40; with room for one more.
  constexpr std::uint64_t kRest = 60;
  const auto at = [](double seconds) { return static_cast<std::uint64_t>(seconds * kRate); };
  for (const auto& [from, to] :
       {std::pair(0.0, 4.0), {4.0, 10.0}, {10.0, 14.0}, {16.0, 20.0}, {20.0, 25.0}, {25.0, 29.0}}) {
    const std::uint64_t first = at(from) + kRest, last = at(to);
    ASSERT_LT(first, last);
    EXPECT_EQ(changes_between(d, first, last), 0) << from << " s: a limit cycle";
    // In the dead band, or as bright as the bright part of the picture allows: darker than the
    // target then, never brighter.
    const double mean = d.cameras[0].at(last - 1).mean;
    EXPECT_LT(std::log2(mean / o.target), o.dead_band + 0.05) << from << " s";
    EXPECT_GT(mean, 0.5 * o.target) << from << " s";
  }
  // Covered there is nothing to gain, and all that there is is tried.
  EXPECT_EQ(d.cameras[0].at(at(16) - 1).had.exposure, o.most);
}

INSTANTIATE_TEST_SUITE_P(ByLatency, ExposureOnTheMock, ::testing::Values(1, 4));

/// Answers as told, after a while.
class SlowCamera final : public CameraDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration&, CameraConfiguration*) noexcept override {
    return DeviceStatus::ok;
  }
  DeviceTiming timing() const noexcept override { return {}; }
  DeviceStatus start(Notifier*) noexcept override { return DeviceStatus::ok; }
  DeviceStatus wait(Duration, Frame* frame) noexcept override {
    frame->exposure = has.exposure;
    frame->gain_db = has.gain_db;
    return DeviceStatus::ok;
  }
  ImageView view(FrameSlot) const noexcept override {
    return {pixels_.data(), kWidth, kHeight, kWidth};
  }
  void release(FrameSlot) noexcept override {}
  void stop() noexcept override {}
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    asked.fetch_add(1);
    if (answer.load() == DeviceStatus::ok) *actual = requested;
    return answer.load();
  }
  CameraStatistics statistics() const noexcept override { return {}; }
  void show(double grey) { std::fill(pixels_.begin(), pixels_.end(), std::uint8_t(grey)); }

  ExposureSetting has{};
  std::atomic<int> asked{0};
  std::atomic<DeviceStatus> answer{DeviceStatus::ok};

 private:
  DeviceInfo info_;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(kWidth * kHeight, 10);  // dark
};

TEST(ExposureControl, aCameraThatAnswersSlowlyKeepsNobodyWaiting) {
  SlowCamera camera;
  const ExposureSetting start{Duration::microseconds(1000), 0};
  camera.has = start;
  ExposureControl control({&camera}, kWidth, kHeight, {}, {}, start, false);
  CameraDevice* watched = control.cameras().front();
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 0; i < 500; ++i) {
    Frame frame;
    EXPECT_EQ(watched->wait({}, &frame), DeviceStatus::ok);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(290))
      << "500 looks; one answer takes 300 ms";
  EXPECT_EQ(control.counters().changes, 1U) << "nothing more is asked while the camera is at it";
  control.settle();
}

TEST(ExposureControl, aCameraThatCannotEndsItAndOneThatForgotIsAskedAgain) {
  const ExposureSetting start{Duration::microseconds(1000), 0};
  SlowCamera unable;
  unable.has = start;
  unable.answer = DeviceStatus::unsupported;
  ExposureControl control({&unable}, kWidth, kHeight, {}, {}, start, true);
  Frame frame;
  for (int i = 0; i < 100; ++i) (void)control.cameras().front()->wait({}, &frame);
  EXPECT_EQ(unable.asked, 1);
  EXPECT_TRUE(control.counters().unsupported);

  exposure::ExposureOptions options;
  options.target = 20;
  options.dead_band = 1;  // 10 grey levels are within a stop of 20
  // Another exposure than it was given, or another gain alone.
  for (const ExposureSetting& has : {ExposureSetting{Duration::microseconds(100), 0},
                                     ExposureSetting{Duration::microseconds(1000), 6}}) {
    SlowCamera forgetful;
    forgetful.has = has;
    ExposureControl again({&forgetful}, kWidth, kHeight, {}, options, start, true);
    for (int i = 0; i < 4 * options.settle_frames; ++i)
      (void)again.cameras().front()->wait({}, &frame);
    EXPECT_EQ(forgetful.asked, 1);
    EXPECT_EQ(again.counters().again, 1U);
  }
}

TEST(ExposureControl, aCameraThatWasAwayDuringAChangeIsGivenItWhenItIsBack) {
  const ExposureSetting start{Duration::microseconds(1000), 0};
  SlowCamera camera;  // dark: a longer exposure is asked for
  camera.has = start;
  camera.answer = DeviceStatus::gone;
  exposure::ExposureOptions options;
  ExposureControl control({&camera}, kWidth, kHeight, {}, options, start, true);
  Frame frame;
  const auto look = [&] { (void)control.cameras().front()->wait({}, &frame); };
  while (camera.asked == 0) look();
  camera.answer = DeviceStatus::ok;
  camera.show(options.target);  // nothing more is to be changed
  for (int i = 0; i < 8 * options.settle_frames && camera.asked == 1; ++i) look();
  EXPECT_EQ(camera.asked, 2);
  EXPECT_EQ(control.counters().again, 1U);
}

}  // namespace
}  // namespace vergence::app
