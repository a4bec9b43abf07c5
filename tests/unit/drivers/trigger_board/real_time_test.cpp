#include <pthread.h>

#include <chrono>

#include "core/memory/thread_allocations.hpp"
#include "drivers/serial/serial.hpp"
#include "tests/support/device_terminal.hpp"
#include "tests/support/no_allocations.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

/// A device in real time and its board, with a terminal between them, at 100 Hz.
struct TerminalRig {
  TerminalRig() {
    TriggerConfiguration requested{.rate_hz = 100};
    EXPECT_EQ(device.configure(requested, nullptr), DeviceStatus::ok) << device.last_error();
  }
  static std::unique_ptr<test::BoardSimulator> simulator() {
    test::BoardSimulatorOptions o{.power_on = monotonic_now()};
    return std::make_unique<test::BoardSimulator>(test::PulseSource{}, o);
  }
  static Options options() {
    Options o{.native_usb = true};
    return o;
  }
  test::DeviceOnTerminal board{simulator()};
  Device device{std::make_unique<SerialPort>(board.port()), options()};
};

TEST(RealTime, concurrentCallsAreSafe) {
  TerminalRig rig;
  for (int round = 0; round < 2; ++round) {
    ASSERT_EQ(rig.device.start(nullptr), DeviceStatus::ok);
    std::atomic<bool> done{false};
    std::thread onlooker([&] {
      while (!done) {
        (void)rig.device.statistics();
        (void)rig.device.timing();
        (void)rig.device.pause(1);
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
      }
    });
    std::uint64_t last = 0;
    int taken = 0;
    std::thread consumer([&] {
      Pulse p;
      for (;;) {
        const DeviceStatus s = rig.device.wait(Duration::seconds(5), &p);
        if (s != DeviceStatus::ok) break;
        if (taken++ > 0 && p.number <= last) ADD_FAILURE() << p.number << " after " << last;
        last = p.number;
        if (!p.mapped || p.host > p.arrival + p.host_error)
          ADD_FAILURE() << "an edge after its report";
      }
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    rig.device.stop();
    done = true;
    consumer.join();
    onlooker.join();
    EXPECT_GT(taken, 5);
  }
}

TEST(RealTime, deviceThreadAllocatesNothingWhileReading) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "needs the allocation hooks; run it in a build without VERGENCE_SANITIZE";
  TerminalRig rig;
  ASSERT_EQ(rig.device.start(nullptr), DeviceStatus::ok);
  Pulse p;
  ASSERT_EQ(rig.device.wait(Duration::seconds(5), &p), DeviceStatus::ok);
  ThreadAllocations::begin();
  test::expect_no_allocations([&] {
    (void)rig.device.pause(2);
    for (int i = 0; i < 50; ++i)
      ASSERT_EQ(rig.device.wait(Duration::seconds(5), &p), DeviceStatus::ok);
    (void)rig.device.statistics();
  });
  ThreadAllocations::end();
  // The simulator's thread, which has the name of the test's, allocates what it sends.
  std::array<char, ThreadAllocations::kNameBytes> own{};
  ASSERT_EQ(pthread_getname_np(pthread_self(), own.data(), own.size()), 0);
  const ThreadAllocations::Counts counts = ThreadAllocations::counts();
  EXPECT_EQ(counts.size, 1U);
  for (std::size_t i = 0; i < counts.size; ++i)
    EXPECT_STREQ(counts.rows[i].name.data(), own.data());
}

}  // namespace
}  // namespace vergence::trigger_board
