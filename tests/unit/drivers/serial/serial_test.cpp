#include "drivers/serial/serial.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

namespace vergence {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr Duration kSoon = Duration::milliseconds(20);
constexpr Duration kLong = Duration::seconds(5);

/// A line under test on a pseudo-terminal, and the other side of it.
class SerialLine : public ::testing::Test {
 protected:
  SerialLine() : master_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0)
      throw std::runtime_error("no pseudo-terminal");
    place_ = std::make_unique<SerialPort>(::ptsname(master_));
    DeviceStatus status = DeviceStatus::ok;
    line_ = place_->open({}, &status);
    if (!line_) throw std::runtime_error("the terminal does not open");
  }
  ~SerialLine() override { hang_up(); }
  SerialLink& line() { return *line_; }
  void send(const Bytes& bytes) {
    ASSERT_EQ(::write(master_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  Bytes received(std::size_t n) {
    Bytes all;
    std::array<std::uint8_t, 4096> some{};
    while (all.size() < n) {
      const ssize_t got = ::read(master_, some.data(), some.size());
      if (got <= 0) break;
      all.insert(all.end(), some.begin(), some.begin() + got);
    }
    return all;
  }
  void hang_up() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }

  int master_;
  std::unique_ptr<SerialPort> place_;
  std::unique_ptr<SerialLink> line_;
};

TEST_F(SerialLine, everyByteIsCarriedBothWays) {
  Bytes all(256);
  // XON, XOFF, CR, NUL and FF are among the bytes.
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  send(all);
  Bytes got;
  const HostStamp before = line().now();
  while (got.size() < all.size()) {
    std::array<std::uint8_t, 100> some{};
    const LineRead r = line().read(some, kLong);
    ASSERT_EQ(r.status, DeviceStatus::ok);
    ASSERT_GT(r.size, 0U);
    got.insert(got.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(r.size));
  }
  EXPECT_EQ(got, all);
  EXPECT_LT(line().now() - before, Duration::seconds(2)) << "no read waits for more than there is";
  ASSERT_EQ(line().write(all, kLong), DeviceStatus::ok);
  EXPECT_EQ(received(all.size()), all);
}

TEST_F(SerialLine, arrivalIsNotBeforeSending) {
  std::array<std::uint8_t, 64> some{};
  HostStamp before = line().now();
  for (int i = 0; i < 50; ++i) {
    const HostStamp sent = line().now();
    send({9});
    const LineRead r = line().read(some, kLong);
    ASSERT_EQ(r.status, DeviceStatus::ok);
    EXPECT_GE(r.arrival, sent);
    EXPECT_GE(r.arrival, before) << "the clock goes one way";
    EXPECT_LE(r.arrival, line().now());
    before = r.arrival;
  }
}

TEST_F(SerialLine, quietLineTimesOutAtTheLimit) {
  std::array<std::uint8_t, 8> some{};
  const HostStamp before = line().now();
  EXPECT_EQ(line().read(some, kSoon).status, DeviceStatus::timeout);
  EXPECT_GE(line().now() - before, kSoon);
  EXPECT_EQ(line().read(some, Duration{}).status, DeviceStatus::timeout);
}

TEST_F(SerialLine, wakeEndsExactlyOneRead) {
  std::array<std::uint8_t, 8> some{};
  std::thread waker([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    line().wake();
  });
  EXPECT_EQ(line().read(some, kLong).status, DeviceStatus::stopped);
  waker.join();
  EXPECT_EQ(line().read(some, Duration{}).status, DeviceStatus::timeout);
  line().wake();
  EXPECT_EQ(line().read(some, Duration{}).status, DeviceStatus::stopped)
      << "the next one, when none waits";
  send({5});
  EXPECT_EQ(line().read(some, kLong).status, DeviceStatus::ok);
}

TEST_F(SerialLine, hangUpDisconnectsAtOnce) {
  hang_up();
  std::array<std::uint8_t, 8> some{};
  const HostStamp before = line().now();
  EXPECT_EQ(line().read(some, kLong).status, DeviceStatus::disconnected);
  EXPECT_EQ(line().read(some, kLong).status, DeviceStatus::disconnected) << "and stays so";
  EXPECT_EQ(line().write(Bytes{1}, kLong), DeviceStatus::disconnected);
  EXPECT_LT(line().now() - before, kLong);
}

TEST_F(SerialLine, discardedInputIsNotRead) {
  send({1, 2, 3});
  std::array<std::uint8_t, 8> some{};
  // The remaining bytes have arrived, too.
  ASSERT_EQ(line().read(std::span(some).first(1), kLong).status, DeviceStatus::ok);
  line().discard_input();
  EXPECT_EQ(line().read(some, Duration{}).status, DeviceStatus::timeout);
}

TEST_F(SerialLine, secondOpenIsBusy) {
  DeviceStatus status = DeviceStatus::ok;
  EXPECT_EQ(place_->open({}, &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::busy);
}

SerialPortInfo usb_port(const std::string& port, const std::string& serial) {
  SerialPortInfo info;
  info.port = port;
  info.usb_serial = serial;
  return info;
}

TEST(SerialPort, movedDeviceIsFoundBySerialNumber) {
  const std::vector<SerialPortInfo> ports{usb_port("/dev/ttyS0", ""), usb_port("/dev/ttyV0", "B"),
                                          usb_port("/dev/ttyV1", "A")};
  EXPECT_EQ(port_with_serial(ports, "A", "/dev/ttyV0"), "/dev/ttyV1") << "V0 is another now";
  EXPECT_EQ(port_with_serial(ports, "A", "/dev/ttyV7"), "/dev/ttyV1");
  EXPECT_EQ(port_with_serial(ports, "C", "/dev/ttyV7"), "/dev/ttyV7") << "nobody is C";
  EXPECT_EQ(port_with_serial(ports, "", "/dev/ttyV7"), "/dev/ttyV7") << "never by no number";
  EXPECT_EQ(port_with_serial(ports, "C", "/dev/ttyV0"), "") << "B has its place, C is away";
  EXPECT_EQ(port_with_serial(ports, "C", "/dev/ttyS0"), "/dev/ttyS0") << "whose nobody knows";
}

TEST(SerialPort, sharedSerialNumberKeepsTheConfiguredPort) {
  // An FT4232H has one number for its four ports, a CP2102 often has "0001".
  const std::vector<SerialPortInfo> ports{usb_port("/dev/ttyV0", "A"), usb_port("/dev/ttyV1", "A"),
                                          usb_port("/dev/ttyV2", "A")};
  EXPECT_EQ(port_with_serial(ports, "A", "/dev/ttyV1"), "/dev/ttyV1");
  EXPECT_EQ(port_with_serial(ports, "A", "/dev/ttyV7"), "/dev/ttyV7") << "which one nobody knows";
}

TEST(ConverterNumber, sharedNumberIsNeverUsedAgain) {
  const auto one = usb_port("/dev/ttyV0", "0001"), other = usb_port("/dev/ttyV1", "0001");
  ConverterNumber shared;
  shared.opened({one, other}, "0001");
  // After the hub restarted this port was listed first.
  shared.opened({one}, "0001");
  EXPECT_EQ(shared.find({other}, "/dev/ttyV0"), "/dev/ttyV0");

  ConverterNumber alone;
  alone.opened({one}, "0001");
  EXPECT_EQ(alone.find({usb_port("/dev/ttyV5", "0001")}, "/dev/ttyV0"), "/dev/ttyV5");
  EXPECT_EQ(alone.find({one, other}, "/dev/ttyV0"), "/dev/ttyV0");
  EXPECT_EQ(alone.find({other}, "/dev/ttyV0"), "/dev/ttyV0");
  EXPECT_EQ(alone.find({usb_port("/dev/ttyV0", "B")}, "/dev/ttyV0"), "") << "that is B's now";
}

TEST(SerialPort, linkToTheSerialNumbersPortIsKept) {
  const std::filesystem::path link =
      std::filesystem::temp_directory_path() / ("vergence-by-id-" + std::to_string(::getpid()));
  std::filesystem::create_symlink("/dev/null", link);
  const std::vector<SerialPortInfo> ports{usb_port("/dev/ttyV0", "A"), usb_port("/dev/null", "A")};
  EXPECT_EQ(port_with_serial(ports, "A", link.string()), link.string());
  std::filesystem::remove(link);
}

TEST(SerialPort, failedOpenGivesItsReason) {
  DeviceStatus status = DeviceStatus::ok;
  EXPECT_EQ(SerialPort("/dev/ttyThatIsNotThere").open({}, &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  EXPECT_EQ(SerialPort("/dev/null").open({}, &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::unsupported);
  EXPECT_EQ(SerialPort("/dev/null").open({0, 1}, &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::unsupported);
  EXPECT_FALSE(read_latency_timer_ms("/dev/null").has_value());
  // The call must not throw, whatever is connected.
  (void)list_serial_ports();
}

}  // namespace
}  // namespace vergence
