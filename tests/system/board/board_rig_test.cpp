// The trigger board's firmware, simulated, at the far end of an emulated FTDI converter: the driver
// on the kernel's ftdi_sio.
#include <dlfcn.h>
#include <errno.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "drivers/serial/serial.hpp"
#include "drivers/trigger_board/trigger_board.hpp"
#include "tests/rigs/board_rig.hpp"
#include "tests/support/within.hpp"

namespace {

constexpr int kNever = -1;
/// Looks at the port in /sys that succeed yet; from then on it has vanished.
std::atomic<int> looks_left{kNever};

}  // namespace

/// In front of the C library's, for the C++ library and libserialport.
extern "C" ssize_t readlink(const char* path, char* target, size_t size) noexcept {
  using Function = ssize_t (*)(const char*, char*, size_t);
  static const auto real = reinterpret_cast<Function>(::dlsym(RTLD_NEXT, "readlink"));
  if (looks_left != kNever && std::string_view(path) == "/sys/class/tty/ttyUSB0") {
    if (looks_left == 0) {
      errno = ENOENT;
      return -1;
    }
    --looks_left;
  }
  return real(path, target, size);
}

namespace vergence {
namespace {

using test::within;

TriggerConfiguration thirty_hertz() {
  TriggerConfiguration c;
  c.rate_hz = 30;
  c.vary = Duration::milliseconds(1);
  return c;
}

std::vector<Pulse> read(TriggerDevice& device, std::size_t most) {
  std::vector<Pulse> all;
  for (Pulse p; all.size() < most && device.wait(Duration::seconds(5), &p) == DeviceStatus::ok;)
    all.push_back(p);
  return all;
}

class BoardRig : public ::testing::Test {
 protected:
  std::unique_ptr<trigger_board::Device> open() {
    std::unique_ptr<trigger_board::Device> device;
    EXPECT_TRUE(within(10, [&] {
      DeviceStatus status = DeviceStatus::ok;
      device = driver_.open_board("", &status);
      return device != nullptr;
    })) << driver_.last_error();
    return device;
  }
  /// Every report against the pulse that was made: number, and the time of the edge within the
  /// bound that goes with it (half of the shortest way there and back: the chip's latency timer is
  /// in it).
  void expect_true_edges(const std::vector<Pulse>& reported) {
    std::map<std::uint64_t, HostStamp> made;
    for (const test::SimulatedPulse& p : board_.pulses()) made[p.number] = p.edge;
    for (const Pulse& p : reported) {
      ASSERT_TRUE(made.contains(p.number)) << p.number;
      ASSERT_TRUE(p.mapped);
      const Duration off = p.host - made[p.number];
      ASSERT_LE(std::abs(off.ns()), p.host_error.ns()) << "pulse " << p.number;
    }
  }

  test::BoardBehindConverter board_;
  trigger_board::Driver driver_;
};

TEST_F(BoardRig, everyPulseIsReportedWithEitherLatencyTimer) {
  for (const int timer : {16, 1}) {
    auto device = open();
    ASSERT_NE(device, nullptr);
    std::ofstream("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer") << timer << std::flush;
    ASSERT_EQ(read_latency_timer_ms("/dev/ttyUSB0"), timer);
    ASSERT_EQ(device->configure(thirty_hertz(), nullptr), DeviceStatus::ok) << device->last_error();
    // The search for the board received bytes at other baud rates.
    const std::uint64_t before = device->statistics().malformed;
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
    const auto reported = read(*device, 90);
    ASSERT_EQ(reported.size(), 90U) << device->last_error();
    for (std::size_t i = 1; i < reported.size(); ++i)
      ASSERT_EQ(reported[i].number, reported[i - 1].number + 1) << "none is lost";
    expect_true_edges(reported);
    EXPECT_LE(device->statistics().malformed, before + 1)
        << "but for what was under way when the line was taken over";
    EXPECT_EQ(device->statistics().lost, 0U);
    device->stop();
  }
}

TEST_F(BoardRig, portRemovedDuringListingIsLeftOut) {
  const auto there = [] {
    const auto ports = list_serial_ports();
    return std::any_of(ports.begin(), ports.end(),
                       [](const SerialPortInfo& p) { return p.port == "/dev/ttyUSB0"; });
  };
  ASSERT_TRUE(within(10, there));
  for (const bool seen_by_the_library : {false, true}) {
    // A second look would fail.
    looks_left = seen_by_the_library ? 1 : 0;
    const bool listed = there();
    looks_left = kNever;
    EXPECT_EQ(listed, seen_by_the_library);
  }
}

}  // namespace
}  // namespace vergence
