#include "drivers/gnss/device.hpp"

#include <chrono>

#include "drivers/gnss/gnss.hpp"
#include "tests/support/device_terminal.hpp"
#include "tests/support/gnss_bytes.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/conformance/serial_conformance.hpp"

namespace vergence::gnss {
namespace {

std::string ubx_epoch(int i) {
  test::PvtBytes pvt;
  pvt.put(9, 1, i / 600), pvt.put(10, 1, i / 10 % 60), pvt.put(16, 4, i % 10 * 100'000'000);
  return pvt.frame();
}

/// One sentence: where it is damaged the epoch is lost.
std::string nmea_epoch(int i) {
  char time[16];
  (void)std::snprintf(time, sizeof(time), "01%02d%02d.%d0", i / 600 % 60, i / 10 % 60, i % 10);
  return test::nmea_sentence(std::string("GPGGA,") + time +
                             ",2729.85,S,15300.822,E,1,9,0.9,20.5,M,39.5,M,,");
}

/// A receiver that sends an epoch every 100 ms.
class Model final : public test::DeviceModel {
 public:
  using Epoch = std::string (*)(int number);
  Model(Epoch epoch, HostStamp start, Duration duration)
      : of_(epoch), start_(start), end_(start + duration) {}
  void receive(std::span<const std::uint8_t>, HostStamp) override {}
  std::optional<HostStamp> next() const override {
    return ended() ? std::nullopt : std::optional(start_ + kInterval * epoch_);
  }
  void produce(HostStamp, std::vector<std::uint8_t>* out) override {
    const std::string bytes = of_(epoch_++);
    out->insert(out->end(), bytes.begin(), bytes.end());
  }
  std::uint32_t baud() const override { return now_baud; }
  void power_cycle(HostStamp) override {}
  bool ended() const override { return start_ + kInterval * epoch_ > end_; }

  std::atomic<std::uint32_t> now_baud{38400};

 private:
  static constexpr Duration kInterval = Duration::milliseconds(100);
  Epoch of_;
  HostStamp start_, end_;
  int epoch_ = 1;
};

/// Runs the device in real time behind a terminal.
test::DeviceOnTerminal on_terminal(Model::Epoch epoch) {
  return test::DeviceOnTerminal(
      std::make_unique<Model>(epoch, monotonic_now(), Duration::seconds(600)));
}

TEST(GnssDevice, otherProtocolIsNamed) {
  const auto receiver = on_terminal(nmea_epoch);
  const auto driver = make_driver({Protocol::ubx, 38400, {}});
  DeviceStatus status = DeviceStatus::ok;
  EXPECT_EQ(driver->open(receiver.port(), &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  EXPECT_TRUE(test::mentions(driver->last_error(), "set ins.driver to nmea"));
}

TEST(GnssDevice, otherRateIsRefusedNamingTheReceivers) {
  const auto receiver = on_terminal(ubx_epoch);
  const auto driver = make_driver({Protocol::ubx, 9600, {}});
  DeviceStatus status = DeviceStatus::failed;
  const auto device = driver->open(receiver.port(), &status);
  ASSERT_EQ(status, DeviceStatus::ok) << driver->last_error();
  EXPECT_EQ(device->configure(120, nullptr), DeviceStatus::unsupported);
  EXPECT_TRUE(test::mentions(device->last_error(), "set ins.rate to 10"));
  EXPECT_EQ(device->start(nullptr), DeviceStatus::bad_configuration);
  EXPECT_EQ(device->configure(10, nullptr), DeviceStatus::ok) << device->last_error();
  EXPECT_TRUE(test::mentions(device->remark(), "no attitude"));
}

template <Protocol kProtocol>
struct JoinedReceiver {
  using Item = InsReading;
  static constexpr double kRate = 10;
  JoinedReceiver(const test::SimulatedLineOptions& line, Duration duration,
                 test::Tampered::Tamper tamper, std::uint32_t baud = 0)
      : model(std::make_shared<Model>(kProtocol == Protocol::ubx ? ubx_epoch : nmea_epoch,
                                      HostStamp{}, duration)),
        receiver(std::make_unique<test::SimulatedLinkFactory>(
                     std::make_shared<test::Tampered>(model, std::move(tamper)), line),
                 {kProtocol, baud, {}}) {}
  DeviceStatus configure() {
    const DeviceStatus status = receiver.connect();
    return status == DeviceStatus::ok ? receiver.configure(kRate, nullptr) : status;
  }
  Device& device() { return receiver; }
  static std::pair<std::uint64_t, DeviceStamp> order(const InsReading& r) {
    return {r.sample.number, r.measured};
  }
  std::shared_ptr<Model> model;
  Device receiver;
};

TEST(GnssDevice, changedBaudRateIsFoundUnlessConfigured) {
  for (const std::uint32_t asked : {0U, 38400U}) {
    JoinedReceiver<Protocol::ubx> joined({}, Duration::seconds(600), {}, asked);
    ASSERT_EQ(joined.configure(), DeviceStatus::ok) << joined.receiver.last_error();
    ASSERT_EQ(joined.receiver.start(nullptr), DeviceStatus::ok);
    InsReading r;
    ASSERT_EQ(joined.receiver.wait(Duration::seconds(5), &r), DeviceStatus::ok);
    joined.model->now_baud = 115200;
    ASSERT_EQ(test::end_of(joined.receiver, &r), DeviceStatus::disconnected);
    for (int i = 0; i < 200 && joined.receiver.start(nullptr) == DeviceStatus::disconnected; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(joined.receiver.wait(Duration::seconds(1), &r),
              asked == 0 ? DeviceStatus::ok : DeviceStatus::disconnected);
    EXPECT_EQ(joined.receiver.last_error(), "") << "the owner's alone";
  }
}

}  // namespace
}  // namespace vergence::gnss

namespace vergence::test {
using GnssProtocols = ::testing::Types<gnss::JoinedReceiver<gnss::Protocol::ubx>,
                                       gnss::JoinedReceiver<gnss::Protocol::nmea>>;
INSTANTIATE_TYPED_TEST_SUITE_P(Gnss, SerialConformance, GnssProtocols);
}  // namespace vergence::test
