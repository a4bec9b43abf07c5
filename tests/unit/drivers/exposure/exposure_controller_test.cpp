#include "drivers/exposure/exposure_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <vector>

#include "core/math/random.hpp"
#include "drivers/exposure/applied_exposure.hpp"

namespace vergence::exposure {
namespace {

/// A street's radiances, in grey levels at 8 ms without gain, seen by a sensor that takes a new
/// setting over some frames late.
class Street {
 public:
  Street(int latency, double gamma) : latency_(latency), gamma_(gamma) {
    Random random(11);
    for (double& r : radiance_) r = 70 * std::exp(0.6 * random.normal());
  }
  void set(const ExposureSetting& s) { on_the_way_.push_back({frame_ + latency_, s}); }
  /// The next picture, by light that many times daylight's.
  Brightness shoot(double light, const ExposureOptions& o) {
    while (!on_the_way_.empty() && on_the_way_.front().from <= frame_) {
      had_ = on_the_way_.front().setting;
      on_the_way_.pop_front();
    }
    ++frame_;
    const double factor =
        light * had_.exposure.to_seconds() / 0.008 * std::pow(10, had_.gain_db / 20);
    std::array<std::uint8_t, kWidth * kHeight> pixels{};
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double linear = radiance_[i] * factor;
      pixels[i] =
          static_cast<std::uint8_t>(std::clamp(90 * std::pow(linear / 90, gamma_), 0.0, 255.0));
    }
    static const BrightnessMeter meter(kWidth, kHeight, {});
    last_ = meter.measure({pixels.data(), kWidth, kHeight, kWidth}, o.may_saturate);
    return last_;
  }
  [[nodiscard]] const Brightness& last() const { return last_; }
  [[nodiscard]] const ExposureSetting& had() const { return had_; }
  void begin_with(const ExposureSetting& s) { had_ = s; }

 private:
  static constexpr int kWidth = 96, kHeight = 72;
  struct Coming {
    int from;
    ExposureSetting setting;
  };
  int latency_, frame_ = 0;
  double gamma_;
  std::array<double, kWidth * kHeight> radiance_{};
  std::deque<Coming> on_the_way_;
  ExposureSetting had_{};
  Brightness last_;
};

struct Stretch {
  // Number of changes and frame of the last one within this stretch.
  int changes = 0, last_change = -1;
};

Stretch drive(Street& street, ExposureController& controller, const ExposureOptions& o,
              double light, int frames) {
  Stretch s;
  for (int i = 0; i < frames; ++i)
    if (const auto next = controller.step(street.shoot(light, o))) {
      street.set(*next);
      ++s.changes;
      s.last_change = i;
      EXPECT_GE(next->exposure, o.least);
      EXPECT_LE(next->exposure, o.most);
      EXPECT_TRUE(next->gain_db == 0 || next->exposure == o.most)
          << "gain before the exposure is at its longest";
    }
  return s;
}

/// Latency in frames, and the sensor's response: its exponent.
class ExposureControl : public ::testing::TestWithParam<std::tuple<int, double>> {};

TEST_P(ExposureControl, settlesAfterEveryChangeOfLight) {
  const auto [latency, gamma] = GetParam();
  const ExposureOptions o;
  const ExposureSetting start{Duration::microseconds(4000), 0};
  ExposureController controller(o, start);
  Street street(latency, gamma);
  street.begin_with(start);
  // Daylight, a tunnel, out of it, dusk, noon: at most 5 stops a time. A linear sensor needs a
  // change a stop, one of the square root twice as many until it is in the dead band; every change
  // waits settle_frames.
  const double max_changes = gamma < 1 ? 14 : 8;
  const int frames = static_cast<int>(max_changes) * (o.settle_frames + 1) + 60;
  for (const double light : {1.0, 1.0 / 6, 1.0, 0.3, 8.0, 0.25}) {
    const Stretch s = drive(street, controller, o, light, frames);
    EXPECT_LE(s.changes, max_changes) << "light " << light;
    // A change within the last 60 frames would be a limit cycle.
    EXPECT_LT(s.last_change, frames - 60) << "light " << light;
    const Brightness b = street.last();
    const double off =
        std::min(std::log2(o.target / b.mean), std::log2(kSaturated / std::max(1.0, b.bright)));
    EXPECT_LE(std::abs(off), o.dead_band + 0.05)
        << "light " << light << ", mean " << b.mean << ", bright " << b.bright;
    EXPECT_EQ(street.had().exposure, controller.setting().exposure);
  }
}

TEST_P(ExposureControl, removedCoverIsRecoveredInASecond) {
  const auto [latency, gamma] = GetParam();
  const ExposureOptions o;
  ExposureController controller(o, {o.most, 0});
  Street street(latency, gamma);
  street.begin_with({o.most, 0});
  (void)drive(street, controller, o, 0, 120);
  EXPECT_EQ(controller.setting().exposure, o.most);
  EXPECT_NEAR(controller.setting().gain_db, o.max_gain_db, 1e-9);
  const Stretch back = drive(street, controller, o, 1, 90);
  // 3 stops of gain too much: two changes while it saturates, and one to the target.
  EXPECT_LE(back.last_change, (gamma < 1 ? 6 : 4) * o.settle_frames);
  EXPECT_NEAR(std::log2(o.target / street.last().mean), 0, 2 * o.dead_band);
}

INSTANTIATE_TEST_SUITE_P(WhateverTheCamera, ExposureControl,
                         ::testing::Combine(::testing::Values(1, 2, 3, 4),
                                            ::testing::Values(1.0, 0.5)));

TEST(ExposureController, deadBandOrNoSamplesChangeNothing) {
  const ExposureOptions o;
  ExposureController controller(o, {Duration::microseconds(2000), 0});
  for (int i = 0; i < 50; ++i) {
    EXPECT_FALSE(controller.step({o.target * std::exp2(0.9 * o.dead_band), 200, 0, 1728}));
    EXPECT_FALSE(controller.step({}));
  }
}

TEST(ExposureController, partlySaturatedImageIsNotBrightened) {
  const ExposureOptions o;
  ExposureController controller(o, {Duration::microseconds(2000), 0});
  // Dark on the whole, but a tenth of it is sky at the end of the scale.
  const auto next = controller.step({40, 255, 0.1, 1728});
  ASSERT_TRUE(next);
  EXPECT_LT(next->exposure, Duration::microseconds(2000));
}

TEST(BrightnessMeter, onlyUnmaskedPixelsAreMeasured) {
  constexpr int kWidth = 640, kHeight = 480;
  std::vector<std::uint8_t> image(kWidth * kHeight, 40), mask(kWidth * kHeight, 255);
  std::fill(image.begin() + kWidth * kHeight / 2, image.end(), std::uint8_t{255});
  std::fill(mask.begin() + kWidth * kHeight / 2, mask.end(), std::uint8_t{0});
  const ImageView view{image.data(), kWidth, kHeight, kWidth},
      hidden{mask.data(), kWidth, kHeight, kWidth};
  const Brightness all = BrightnessMeter(kWidth, kHeight, {}).measure(view, 0.05);
  EXPECT_NEAR(all.mean, 0.5 * (40 + 255), 1e-9);
  EXPECT_EQ(all.bright, 255);
  EXPECT_NEAR(all.saturated, 0.5, 1e-9);
  const BrightnessMeter half(kWidth, kHeight, hidden);
  const Brightness shown = half.measure(view, 0.05);
  EXPECT_EQ(shown.mean, 40);
  EXPECT_EQ(shown.bright, 40);
  EXPECT_EQ(shown.saturated, 0);
  EXPECT_EQ(half.places(),
            static_cast<std::size_t>(BrightnessMeter::kColumns * BrightnessMeter::kRows / 2));
  EXPECT_EQ(half.measure({image.data(), 100, 100, 100}, 0.05).samples, 0) << "another size";
  EXPECT_EQ(half.measure({}, 0.05).samples, 0);
  EXPECT_EQ(BrightnessMeter(3, 2, {}).places(), 6U);
}

TEST(AppliedExposure, isTheOneWrittenBeforeTheFrame) {
  AppliedExposure a;
  const auto us = [](int n) { return ExposureSetting{Duration::microseconds(n), 0}; };
  a.reset(us(1));
  EXPECT_EQ(a.at(HostStamp(5)), us(1));
  EXPECT_TRUE(a.change(us(2), HostStamp(10)));
  EXPECT_TRUE(a.change(us(3), HostStamp(20)));
  EXPECT_EQ(a.at(HostStamp(9)), us(1));
  EXPECT_EQ(a.at(HostStamp(10)), us(2));
  EXPECT_EQ(a.at(HostStamp(19)), us(2));
  EXPECT_EQ(a.at(HostStamp(30)), us(3));
  EXPECT_TRUE(a.change(us(4), HostStamp(40)));
  EXPECT_TRUE(a.change(us(5), HostStamp(41)));
  EXPECT_EQ(a.at(HostStamp(50)), us(5));
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(a.change(us(6), HostStamp(60)));
  EXPECT_FALSE(a.change(us(7), HostStamp(60)));
  a.reset(us(9));
  EXPECT_EQ(a.at(HostStamp(1000)), us(9));
}

}  // namespace
}  // namespace vergence::exposure
