#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "tests/rigs/iidc_rig.hpp"
#include "tests/support/camera_options.hpp"

/// Cases for both buses: one set of cases, included once by each bus's test with its own
/// BusUnderTest.
///
///   struct BusUnderTest { static constexpr const char* kEmulator; static constexpr const char*
///   kSent;   // its word for frames sent whole
///                         static std::unique_ptr<CameraDriver> driver();
///                         static void unplug(Emulator*, unsigned), replug(Emulator*, unsigned); };
namespace vergence::test {

class IidcRig : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!inside_rig()) GTEST_SKIP() << kNeedsRig;
  }
  /// The emulator, and its two cameras configured.
  void begin(const CameraConfiguration& requested, std::vector<std::string> arguments = {}) {
    ASSERT_TRUE(await_cameras(driver_.get(), 0)) << "those of the test before";
    emulator_ = std::make_unique<Emulator>(BusUnderTest::kEmulator, std::move(arguments));
    ASSERT_TRUE(await_cameras(driver_.get(), 2));
    for (unsigned k = 0; k < 2; ++k) {
      cameras_.push_back(open_camera(driver_.get(), k, requested));
      ASSERT_NE(cameras_.back(), nullptr);
    }
    collector_ = std::make_unique<FrameCollector>(
        std::vector<CameraDevice*>{cameras_[0].get(), cameras_[1].get()});
  }
  void start() {
    for (const auto& c : cameras_)
      ASSERT_EQ(c->start(nullptr), DeviceStatus::ok) << c->last_error();
  }
  /// n pulses, slower than the cameras can take them.
  void pulse(int n) {
    for (int i = 0; i < n; ++i) {
      emulator_->command("trigger");
      std::this_thread::sleep_for(std::chrono::milliseconds(70));
      collector_->drain(Duration{});
    }
  }
  /// Ends everything; what the emulator says it did.
  std::string end() {
    for (const auto& c : cameras_) c->stop();
    const std::string report = emulator_->finish();
    emulator_.reset();
    return report;
  }

  std::unique_ptr<CameraDriver> driver_ = BusUnderTest::driver();
  std::unique_ptr<Emulator> emulator_;
  std::vector<std::unique_ptr<CameraDevice>> cameras_;
  std::unique_ptr<FrameCollector> collector_;
};

TEST_F(IidcRig, camerasAreListedAndOpenedBySerial) {
  ASSERT_NO_FATAL_FAILURE(begin(usual()));
  const auto found = driver_->enumerate();
  ASSERT_EQ(found.size(), 2U);
  for (unsigned k = 0; k < 2; ++k) {
    EXPECT_EQ(cameras_[k]->info().serial, emulated_serial(k));
    EXPECT_EQ(cameras_[k]->info().model, "Emulated IIDC " + std::to_string(k));
  }
  DeviceStatus status = DeviceStatus::ok;
  EXPECT_EQ(driver_->open(emulated_serial(0), &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::busy) << "two programs on one camera";
  EXPECT_FALSE(driver_->last_error().empty());
  EXPECT_EQ(driver_->open("15021234", &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  (void)end();
}

TEST_F(IidcRig, everyPulseGivesOneFrameOrIsCountedLost) {
  ASSERT_NO_FATAL_FAILURE(begin(usual(CameraTrigger::hardware)));
  ASSERT_NO_FATAL_FAILURE(start());
  pulse(5);
  emulator_->command("drop 1 3");
  pulse(5);
  pulse(10);
  collector_->drain();
  const std::string report = end();
  for (int k = 0; k < 2; ++k) {
    const Account& a = collector_->account(static_cast<std::size_t>(k));
    const CameraStatistics s = cameras_[static_cast<std::size_t>(k)]->statistics();
    EXPECT_EQ(count_of(report, k, "exposed"), 20) << report;
    EXPECT_EQ(static_cast<std::int64_t>(a.complete), count_of(report, k, BusUnderTest::kSent))
        << report;
    EXPECT_EQ(static_cast<std::int64_t>(s.lost),
              count_of(report, k, "dropped") + count_of(report, k, "overtaken"))
        << report;
    EXPECT_EQ(count_of(report, k, "dropped"), k == 1 ? 3 : 0);
    EXPECT_EQ(a.complete + s.lost, 20U);
    EXPECT_EQ(a.gaps, s.lost);
    EXPECT_EQ(a.incomplete + a.wrong + s.underruns, 0U);
    // A frame stamped by its pulse: the camera's clock and the emulator's run alike.
    for (std::size_t i = 1; i < a.starts.size(); ++i)
      EXPECT_NEAR(static_cast<double>(a.starts[i] - a.starts[i - 1]),
                  static_cast<double>(a.middles[i] - a.middles[i - 1]), 200);
  }
  EXPECT_EQ(collector_->account(0).middles.back(), collector_->account(1).middles.back())
      << "one pulse, one instant";
}

TEST_F(IidcRig, onlyTruncatedFrameIsMarkedIncomplete) {
  ASSERT_NO_FATAL_FAILURE(begin(usual(CameraTrigger::hardware)));
  ASSERT_NO_FATAL_FAILURE(start());
  pulse(4);
  emulator_->command("tear 0 1");
  pulse(6);
  emulator_->command("tear 0 1");
  pulse(6);
  collector_->drain();
  const std::string report = end();
  const Account& a = collector_->account(0);
  const CameraStatistics s = cameras_[0]->statistics();
  EXPECT_EQ(count_of(report, 0, "incomplete"), 2) << report;
  EXPECT_EQ(a.incomplete, 2U);
  EXPECT_EQ(a.wrong, 0U) << "an incomplete frame was called complete";
  EXPECT_EQ(s.lost, BusUnderTest::kLostWithIncomplete * 2) << report;
  EXPECT_EQ(a.complete + a.incomplete + s.lost, 16U) << report;
  EXPECT_EQ(collector_->account(1).complete, 16U);
}

TEST_F(IidcRig, replugWhileStreamingLeaksNothing) {
  ASSERT_NO_FATAL_FAILURE(begin(usual()));
  ASSERT_NO_FATAL_FAILURE(start());
  ASSERT_TRUE(collector_->read(10));
  const Holdings before = Holdings::now();
  for (int round = 0; round < 3; ++round) {
    BusUnderTest::unplug(emulator_.get(), 1);
    Frame frame;
    DeviceStatus status = DeviceStatus::ok;
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    Frame held;
    bool holds = false;
    while (status != DeviceStatus::disconnected && std::chrono::steady_clock::now() < limit) {
      status = cameras_[1]->wait(Duration::milliseconds(200), &frame);
      if (status != DeviceStatus::ok) continue;
      if (holds) {
        cameras_[1]->release(frame.slot);
      } else {
        held = frame;
        holds = true;
      }
    }
    ASSERT_EQ(status, DeviceStatus::disconnected);
    std::uint32_t number = 0;
    if (holds) number = read_stamp(cameras_[1]->view(held.slot)).number;
    EXPECT_EQ(cameras_[1]->start(nullptr), DeviceStatus::disconnected);
    EXPECT_FALSE(cameras_[1]->last_error().empty());
    BusUnderTest::replug(emulator_.get(), 1);
    ASSERT_TRUE(start_again(cameras_[1].get())) << cameras_[1]->last_error();
    if (holds) {
      EXPECT_EQ(read_stamp(cameras_[1]->view(held.slot)).number, number)
          << "an image that is held stays, whatever happens to its camera";
      cameras_[1]->release(held.slot);
    }
    collector_->restarted(1);
    ASSERT_TRUE(collector_->read(10))
        << "camera 1 after the replug, camera 0 all along: " << cameras_[1]->last_error();
    // This frees what waited for the release of the last image.
    cameras_[1]->stop();
    collector_->restarted(1);
    ASSERT_EQ(cameras_[1]->start(nullptr), DeviceStatus::ok) << cameras_[1]->last_error();
    ASSERT_TRUE(collector_->read(3));
    EXPECT_EQ(Holdings::now(), before)
        << "round " << round << ": " << Holdings::now().descriptors << " descriptors instead of "
        << before.descriptors << ", " << Holdings::now().mappings << " mappings instead of "
        << before.mappings;
  }
  EXPECT_EQ(collector_->account(0).wrong + collector_->account(1).wrong, 0U);
  EXPECT_EQ(cameras_[0]->statistics().starts, 1U) << "the other camera goes on";
  (void)end();
}

}  // namespace vergence::test
