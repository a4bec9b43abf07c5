#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <thread>

#include "tests/support/simulators/simulators.hpp"
#include "tests/support/tampered.hpp"

/// The one suite that every device on a serial line passes (INS, satellite receiver, trigger
/// board), in virtual time on a simulated line.
///
/// A device joins with a struct and INSTANTIATE_TYPED_TEST_SUITE_P(Name, SerialConformance,
/// Struct):
///   struct Joined {
///     using Item = Pulse;                   // what wait() gives
///     static constexpr double kRate = 30;   // of them in a second
///     Joined(const SimulatedLineOptions&, Duration duration, test::Tampered::Tamper);
///     DeviceStatus configure();
///     TriggerDevice& device();
///     static std::pair<std::uint64_t, DeviceStamp> order(const Item&);  // its number, and its
///     stamp by the device's clock
///   };
namespace vergence::test {

[[nodiscard]] inline HostStamp at_s(double s) { return HostStamp{} + Duration::seconds(s); }

/// Collects samples until there are no more, or this many; `disconnected` is counted and passed
/// over, the device is asked to come back.
template <class Item, class Device>
[[nodiscard]] std::vector<Item> all_of(Device& device, std::size_t most, int* disconnects) {
  std::vector<Item> all;
  while (all.size() < most) {
    Item item;
    const DeviceStatus s = device.wait(Duration::seconds(20), &item);
    if (s == DeviceStatus::ok) {
      all.push_back(item);
    } else if (s == DeviceStatus::disconnected) {
      ++*disconnects;
      while (device.start(nullptr) == DeviceStatus::disconnected) std::this_thread::yield();
    } else {
      break;
    }
  }
  return all;
}

/// Waits for another status than `ok`.
template <class Item, class Device>
[[nodiscard]] DeviceStatus end_of(Device& device, Item* last) {
  DeviceStatus s = DeviceStatus::ok;
  while (s == DeviceStatus::ok) s = device.wait(Duration::seconds(20), last);
  return s;
}

/// Something else on the port: says the same every 200 ms, and answers as it is told.
class Talker final : public DeviceModel {
 public:
  using Answer = std::function<std::vector<std::uint8_t>(std::span<const std::uint8_t>)>;
  Talker(std::string mentions, std::uint32_t baud, Answer answer = {})
      : says_(std::move(mentions)), answer_(std::move(answer)), baud_(baud) {}
  void receive(std::span<const std::uint8_t> bytes, HostStamp at) override {
    now_ = at;
    if (!answer_) return;
    const auto a = answer_(bytes);
    out_.insert(out_.end(), a.begin(), a.end());
  }
  std::optional<HostStamp> next() const override {
    return !out_.empty()   ? std::optional(now_)
           : says_.empty() ? std::nullopt
                           : std::optional(next_);
  }
  void produce(HostStamp at, std::vector<std::uint8_t>* out) override {
    out->insert(out->end(), out_.begin(), out_.end());
    out_.clear();
    if (says_.empty() || at < next_) return;
    out->insert(out->end(), says_.begin(), says_.end());
    next_ = at + Duration::milliseconds(200);
  }
  std::uint32_t baud() const override { return baud_; }
  void power_cycle(HostStamp) override {}

 private:
  std::string says_;
  Answer answer_;
  std::uint32_t baud_;
  std::vector<std::uint8_t> out_;
  HostStamp now_{}, next_{};
};

template <class Joined>
struct SerialConformance : ::testing::Test {
  using Item = typename Joined::Item;

  void begin(const SimulatedLineOptions& line = {}, Tampered::Tamper tamper = {},
             double seconds = 30) {
    rig = std::make_unique<Joined>(line, Duration::seconds(seconds), std::move(tamper));
    ASSERT_EQ(rig->configure(), DeviceStatus::ok) << rig->device().last_error();
    ASSERT_EQ(rig->device().start(nullptr), DeviceStatus::ok) << rig->device().last_error();
  }
  /// To the end of its time, stamps in order.
  std::vector<Item> read_to_end() {
    const auto all = all_of<Item>(rig->device(), SIZE_MAX, &disconnects);
    EXPECT_FALSE(all.empty());
    for (std::size_t i = 0; i < all.size() && !::testing::Test::HasFailure(); ++i) {
      EXPECT_TRUE(all[i].mapped);
      EXPECT_TRUE(i == 0 || all[i].host > all[i - 1].host) << i;
      EXPECT_TRUE(i == 0 || all[i].arrival >= all[i - 1].arrival) << i;
    }
    EXPECT_TRUE(all.empty() || all.back().arrival > at_s(29.4));
    return all;
  }

  std::unique_ptr<Joined> rig;
  int disconnects = 0;
};
TYPED_TEST_SUITE_P(SerialConformance);

TYPED_TEST_P(SerialConformance, stopsAndStartsAgain) {
  // Longer than what fits into its ring, so that it has not ended when it is started again.
  this->begin({}, {}, 300);
  auto& device = this->rig->device();
  typename TypeParam::Item item;
  for (std::uint64_t i = 1; i <= 3; ++i) {
    ASSERT_EQ(device.start(nullptr), DeviceStatus::ok) << "the first time it is started already";
    EXPECT_EQ(all_of<typename TypeParam::Item>(device, 20, &this->disconnects).size(), 20U);
    device.stop();
    device.stop();
    EXPECT_EQ(device.wait(Duration{}, &item), DeviceStatus::stopped);
    EXPECT_EQ(device.statistics().starts, i);
  }
  EXPECT_EQ(this->disconnects, 0);
}

TYPED_TEST_P(SerialConformance, reconnectsAfterUnplugPoweredOrNot) {
  SimulatedLineOptions line{.outages = {{at_s(10), at_s(13), true}, {at_s(18), at_s(20), false}}};
  this->begin(line);
  const auto all = this->read_to_end();
  EXPECT_EQ(this->disconnects, 2);
  EXPECT_GT(static_cast<double>(all.size()), 15 * TypeParam::kRate);
}

TYPED_TEST_P(SerialConformance, startsAfterAStopDuringAnOutage) {
  SimulatedLineOptions line{.outages = {{at_s(10), at_s(13), true}}};
  this->begin(line, {}, 120);
  typename TypeParam::Item last;
  ASSERT_EQ(end_of(this->rig->device(), &last), DeviceStatus::disconnected);
  EXPECT_GE(last.arrival, at_s(10));
  this->rig->device().stop();
  ASSERT_EQ(this->rig->device().start(nullptr), DeviceStatus::ok);
  EXPECT_GT(this->read_to_end().front().arrival, at_s(13)) << "nothing of the first start";
}

TYPED_TEST_P(SerialConformance, noiseOrSilenceIsADisconnect) {
  this->begin({}, [](HostStamp at, std::vector<std::uint8_t>* bytes) {
    if (at > at_s(12) && at < at_s(18)) std::fill(bytes->begin(), bytes->end(), std::uint8_t{0x55});
  });
  (void)this->read_to_end();
  EXPECT_EQ(this->disconnects, 1);
}

TYPED_TEST_P(SerialConformance, flippedBitsLoseOnlyTheirMessages) {
  SimulatedLineOptions line{.corrupt = 2e-4};
  this->begin(line);
  const auto all = this->read_to_end();
  EXPECT_EQ(this->disconnects, 0);
  EXPECT_GT(static_cast<double>(all.size()), 20 * TypeParam::kRate);
  const auto s = this->rig->device().statistics();
  EXPECT_GT(s.malformed, 0U);
  EXPECT_GT(s.lost, 0U);
  for (std::size_t i = 1; i < all.size(); ++i) {
    const auto [number, stamp] = TypeParam::order(all[i]);
    const auto [number_before, stamp_before] = TypeParam::order(all[i - 1]);
    ASSERT_GT(number, number_before);
    ASSERT_NEAR((stamp - stamp_before).to_seconds() * TypeParam::kRate,
                static_cast<double>(number - number_before), 0.01);
  }
}

REGISTER_TYPED_TEST_SUITE_P(SerialConformance, stopsAndStartsAgain,
                            reconnectsAfterUnplugPoweredOrNot, startsAfterAStopDuringAnOutage,
                            noiseOrSilenceIsADisconnect, flippedBitsLoseOnlyTheirMessages);

}  // namespace vergence::test
