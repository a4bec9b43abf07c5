#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <thread>
#include <vector>

#include "app/runtime/camera_drivers.hpp"
#include "app/runtime/live_source.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/gvsp_sender.hpp"

namespace vergence {
namespace {

using app::LiveItem;
using app::LiveSource;

constexpr int kWidth = 640, kHeight = 480, kPulses = 120;
constexpr double kRate = 40;

/// Two simulated cameras on one pulse, driver, pairing: numbers of the pairs that came out complete.
struct Pairs {
  explicit Pairs(const char* resend, double loss) {
    std::vector<app::CameraRequest> requests;
    for (int k = 0; k < 2; ++k) {
      test::GigeCameraOptions o;
      o.address = test::GigeCamera::address(k);
      o.serial = "PAIR-" + std::to_string(k);
      o.sensor_width = kWidth;
      o.sensor_height = kHeight;
      o.seed = static_cast<std::uint64_t>(k) + 5;
      o.clock_drift_ppm = k == 0 ? 40 : -35;
      o.clock_offset_ns = 1'000'000'000'000 * (k + 3);
      o.discoverable = false;
      simulators.push_back(std::make_unique<test::GigeCamera>(o));
      app::CameraRequest r{"cameras." + std::to_string(k), "gige", o.address, {kWidth, kHeight, kRate, Duration::milliseconds(2), 0}};
      r.configuration.options = {{"packet_size", "16000"}, {"resend", resend}};
      requests.push_back(std::move(r));
    }
    std::vector<std::string> remarks;
    cameras = app::open_cameras(requests, &remarks);
    LiveSource::Options o;
    o.sync.interval = Duration::seconds(1 / kRate);
    o.sync.align_start = true;
    source =
        std::make_unique<LiveSource>(std::vector<CameraDevice*>{cameras[0].device.get(), cameras[1].device.get()}, nullptr, nullptr, o);
    source->start();
    std::thread pulses([this, loss] {
      pulse(0, 5);
      for (const auto& s : simulators) s->set_loss(loss);
      pulse(5, kPulses - 5);
      for (const auto& s : simulators) s->set_loss(0);
      pulse(kPulses - 5, kPulses);
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      source->stop();
    });
    for (LiveItem item; source->next(&item);) {
      if (item.kind != LiveItem::Kind::images) continue;
      take(item);
      source->release(item.set);
    }
    pulses.join();
    source->join();
  }
  void pulse(int from, int to) {
    for (int n = from; n < to; ++n) {
      for (const auto& s : simulators) s->pulse(static_cast<std::uint64_t>(n));
      std::this_thread::sleep_for(std::chrono::duration<double>(1 / kRate));
    }
  }
  void take(const LiveItem& item) {
    std::uint64_t numbers[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
      if (!item.set.present[static_cast<std::size_t>(k)]) return;
      const ImageView image = source->image(item.set, k);
      for (int i = 7; i >= 0; --i) numbers[k] = numbers[k] << 8U | image.at(i, 0);
    }
    EXPECT_EQ(numbers[0], numbers[1]) << "images of two pulses in one set";
    EXPECT_EQ(item.set.proof, SyncProof::counted);
    EXPECT_LT(item.set.spread, Duration::milliseconds(5));
    complete.push_back(numbers[0]);
  }
  /// Pulses of which both cameras sent their image whole.
  [[nodiscard]] std::vector<std::uint64_t> whole() const {
    const auto left = simulators[0]->whole(), right = simulators[1]->whole();
    std::vector<std::uint64_t> both;
    std::set_intersection(left.begin(), left.end(), right.begin(), right.end(), std::back_inserter(both));
    return both;
  }

  std::vector<std::unique_ptr<test::GigeCamera>> simulators;
  std::vector<app::OpenedCamera> cameras;
  std::unique_ptr<LiveSource> source;
  std::vector<std::uint64_t> complete;
};

TEST(GigePairs, withoutResendEveryPairThatCameWholePairsUp) {
  const Pairs p("off", 0.01);
  const auto whole = p.whole();
  EXPECT_EQ(p.complete.size(), whole.size());
  for (const std::uint64_t n : whole)
    EXPECT_TRUE(std::binary_search(p.complete.begin(), p.complete.end(), n)) << "pair " << n << " came whole";
  EXPECT_LT(p.complete.size(), kPulses - 15U) << "a fifth of the frames is torn";
  EXPECT_GT(p.complete.size(), 40U);
  const auto& c = p.source->counters();
  EXPECT_EQ(c.dropped_sets, 0U);
  for (std::size_t k = 0; k < 2; ++k) {
    const test::GigeCameraReport r = p.simulators[k]->report();
    const CameraStatistics s = p.cameras[k].device->statistics();
    EXPECT_EQ(r.exposed, static_cast<std::uint64_t>(kPulses));
    EXPECT_EQ(s.delivered - s.torn, r.whole);
    EXPECT_EQ(s.torn, r.torn);
    EXPECT_EQ(s.lost, r.headless + r.nothing);
  }
}

TEST(GigePairs, withResendEveryPairPairsUp) {
  const Pairs p("on", 0.005);
  EXPECT_EQ(p.complete.size(), static_cast<std::size_t>(kPulses));
  EXPECT_EQ(p.source->counters().sync.unproven, 0U);
  EXPECT_EQ(p.source->counters().torn, 0U);
}

}  // namespace
}  // namespace vergence
