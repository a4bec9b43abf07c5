#include "drivers/gnss/device.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "drivers/gnss/gnss.hpp"
#include "tests/support/gnss_bytes.hpp"
#include "tests/support/receiver_terminal.hpp"

namespace vergence::gnss {
namespace {

using test::Receiver;

std::string ubx_epoch(int i) {
  test::PvtBytes pvt;
  pvt.put(9, 1, i / 600), pvt.put(10, 1, i / 10 % 60), pvt.put(16, 4, i % 10 * 100'000'000);
  return pvt.frame();
}

std::string nmea_epoch(int i) {
  char time[16];
  (void)std::snprintf(time, sizeof(time), "01%02d%02d.%d0", i / 600 % 60, i / 10 % 60, i % 10);
  return test::nmea_sentence(std::string("GPRMC,") + time +
                             ",A,2729.85,S,15300.822,E,10.0,45.0,290224,,,A") +
         test::nmea_sentence(std::string("GPGGA,") + time +
                             ",2729.85,S,15300.822,E,1,9,0.9,20.5,M,39.5,M,,");
}

void expect_readings(InsDevice* device) {
  double actual = 0;
  ASSERT_EQ(device->configure(10, &actual), DeviceStatus::ok) << device->last_error();
  EXPECT_NEAR(actual, 10, 1e-6);
  EXPECT_NE(device->remark().find("no attitude"), std::string::npos);
  ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
  InsReading last;
  for (int i = 0; i < 5; ++i) {
    InsReading r;
    ASSERT_EQ(device->wait(Duration::seconds(5), &r), DeviceStatus::ok);
    EXPECT_TRUE(r.mapped);
    EXPECT_EQ(r.sample.fix, FixStatus::fix_3d);
    EXPECT_EQ(r.sample.heading_source, HeadingSource::course);
    EXPECT_NEAR(r.sample.position.latitude_deg, -27.4975, 1e-9);
    EXPECT_LE(r.host, r.arrival);
    if (i > 0) {
      EXPECT_GT(r.measured, last.measured);
      EXPECT_GT(r.host, last.host);
    }
    last = r;
  }
  device->stop();
  EXPECT_EQ(device->statistics().delivered, 5U);
  EXPECT_EQ(device->statistics().malformed, 0U);
}

std::unique_ptr<InsDevice> opened(Driver* driver, const std::string& port) {
  DeviceStatus status = DeviceStatus::failed;
  auto device = driver->open(port, &status);
  EXPECT_EQ(status, DeviceStatus::ok) << driver->last_error();
  return device;
}

TEST(GnssDevice, ubxIsFoundAndRead) {
  Receiver receiver(ubx_epoch);
  Driver driver({Protocol::ubx, 0, {}});
  const auto device = opened(&driver, receiver.port());
  ASSERT_NE(device, nullptr);
  expect_readings(device.get());
}

TEST(GnssDevice, nmeaIsFoundAndRead) {
  Receiver receiver(nmea_epoch);
  Driver driver({Protocol::nmea, 38400, {}});
  const auto device = opened(&driver, receiver.port());
  ASSERT_NE(device, nullptr);
  expect_readings(device.get());
}

TEST(GnssDevice, theOtherProtocolIsNamed) {
  Receiver receiver(nmea_epoch);
  Driver driver({Protocol::ubx, 38400, {}});
  DeviceStatus status = DeviceStatus::ok;
  EXPECT_EQ(driver.open(receiver.port(), &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  EXPECT_NE(driver.last_error().find("set ins.driver to nmea"), std::string::npos)
      << driver.last_error();
}

TEST(GnssDevice, anotherRateIsRefusedWithTheReceiversOwn) {
  Receiver receiver(ubx_epoch);
  Driver driver({Protocol::ubx, 9600, {}});
  const auto device = opened(&driver, receiver.port());
  ASSERT_NE(device, nullptr);
  EXPECT_EQ(device->configure(120, nullptr), DeviceStatus::unsupported);
  EXPECT_NE(device->last_error().find("set ins.rate to 10"), std::string::npos)
      << device->last_error();
  EXPECT_EQ(device->start(nullptr), DeviceStatus::bad_configuration);
}

TEST(GnssDevice, silenceIsGoneAndFixesBringItBack) {
  Receiver receiver(ubx_epoch);
  Driver driver({Protocol::ubx, 9600, {}});
  const auto device = opened(&driver, receiver.port());
  ASSERT_NE(device, nullptr);
  ASSERT_EQ(device->configure(10, nullptr), DeviceStatus::ok);
  ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
  receiver.turn(false);
  InsReading r;
  DeviceStatus status = DeviceStatus::ok;
  for (int i = 0; i < 10 && status == DeviceStatus::ok; ++i)
    status = device->wait(Duration::seconds(10), &r);
  ASSERT_EQ(status, DeviceStatus::gone);
  receiver.turn(true);
  for (int i = 0; i < 200 && device->start(nullptr) == DeviceStatus::gone; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(device->wait(Duration::seconds(5), &r), DeviceStatus::ok);
}

/// A receiver at a baud rate of its own, an epoch every 100 ms of virtual time.
struct Wire {
  std::atomic<std::uint32_t> baud{38400};
  std::atomic<std::int64_t> now{1'000'000'000};  // ns
};

class WireLine final : public ByteLine {
 public:
  WireLine(Wire* wire, std::uint32_t baud) : wire_(*wire), baud_(baud) {}
  [[nodiscard]] LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    constexpr std::int64_t kEpoch = 100'000'000;
    if (woken_.exchange(false)) return {DeviceStatus::stopped, 0, {}};
    const std::int64_t number = wire_.now / kEpoch + 1, next = number * kEpoch;
    if (wire_.baud != baud_ || next > wire_.now + limit.ns()) {
      wire_.now += limit.ns();
      return {};
    }
    wire_.now = next;
    const std::string bytes = ubx_epoch(static_cast<int>(number));
    std::copy(bytes.begin(), bytes.end(), out.begin());
    return {DeviceStatus::ok, bytes.size(), now()};
  }
  [[nodiscard]] DeviceStatus write(std::span<const std::uint8_t>, Duration) noexcept override {
    return DeviceStatus::failed;
  }
  [[nodiscard]] DeviceStatus set_baud(std::uint32_t baud) noexcept override {
    baud_ = baud;
    return DeviceStatus::ok;
  }
  [[nodiscard]] std::uint32_t baud() const noexcept override { return baud_; }
  void discard_input() noexcept override {}
  void wake() noexcept override { woken_ = true; }
  [[nodiscard]] HostStamp now() const noexcept override { return HostStamp(wire_.now); }

 private:
  Wire& wire_;
  std::uint32_t baud_;
  std::atomic<bool> woken_{false};
};

class WirePlace final : public LinePlace {
 public:
  explicit WirePlace(Wire* wire) : wire_(*wire) {}
  [[nodiscard]] std::unique_ptr<ByteLine> open(const LineSettings& settings,
                                               DeviceStatus* status) override {
    *status = DeviceStatus::ok;
    return std::make_unique<WireLine>(&wire_, settings.baud);
  }
  [[nodiscard]] std::string name() const override { return "wire"; }
  [[nodiscard]] bool pass(Duration time) override {
    wire_.now += time.ns();
    return true;
  }

 private:
  Wire& wire_;
};

/// What wait() says once the receiver went over from 38400 to 115200 baud and was waited for.
DeviceStatus after_another_baud(std::uint32_t asked) {
  Wire wire;
  Device device(std::make_unique<WirePlace>(&wire), {Protocol::ubx, asked, {}});
  EXPECT_EQ(device.connect(), DeviceStatus::ok) << device.last_error();
  EXPECT_EQ(device.configure(10, nullptr), DeviceStatus::ok) << device.last_error();
  EXPECT_EQ(device.start(nullptr), DeviceStatus::ok);
  InsReading r;
  EXPECT_EQ(device.wait(Duration::seconds(5), &r), DeviceStatus::ok);
  wire.baud = 115200;
  DeviceStatus status = DeviceStatus::ok;
  while (status == DeviceStatus::ok) status = device.wait(Duration::seconds(5), &r);
  EXPECT_EQ(status, DeviceStatus::gone);
  for (int i = 0; i < 200 && device.start(nullptr) == DeviceStatus::gone; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  status = device.wait(Duration::seconds(1), &r);
  EXPECT_EQ(device.last_error(), "") << "the owner's alone";
  return status;
}

TEST(GnssDevice, aReceiverThatComesBackAtAnotherBaudRateIsFoundAgain) {
  EXPECT_EQ(after_another_baud(0), DeviceStatus::ok);
}

TEST(GnssDevice, theBaudRateThatWasAskedForStays) {
  EXPECT_EQ(after_another_baud(38400), DeviceStatus::gone);
}

}  // namespace
}  // namespace vergence::gnss
