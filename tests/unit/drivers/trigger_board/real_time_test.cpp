#include <gtest/gtest.h>

#include <atomic>
#include <chrono>

#include "core/memory/allocation_guard.hpp"
#include "drivers/serial/serial.hpp"
#include "tests/support/device_terminal.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

/// A line that seals whoever reads it, as long as it is told to.
class SealingLine final : public ByteLine {
 public:
  SealingLine(std::unique_ptr<ByteLine> line, const std::atomic<bool>& seal)
      : line_(std::move(line)), seal_(seal) {}
  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    if (seal_ != AllocationGuard::thread_sealed())
      seal_ ? AllocationGuard::seal_thread() : AllocationGuard::unseal_thread();
    return line_->read(out, limit);
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override {
    return line_->write(bytes, limit);
  }
  DeviceStatus set_baud(std::uint32_t baud) noexcept override { return line_->set_baud(baud); }
  std::uint32_t baud() const noexcept override { return line_->baud(); }
  void discard_input() noexcept override { line_->discard_input(); }
  void wake() noexcept override { line_->wake(); }
  HostStamp now() const noexcept override { return line_->now(); }

 private:
  std::unique_ptr<ByteLine> line_;
  const std::atomic<bool>& seal_;
};

/// A port whose lines do so.
class SealingPlace final : public LinePlace {
 public:
  SealingPlace(const std::string& port, const std::atomic<bool>& seal)
      : place_(port), seal_(seal) {}
  std::unique_ptr<ByteLine> open(const LineSettings& settings, DeviceStatus* status) override {
    auto line = place_.open(settings, status);
    return line == nullptr ? nullptr : std::make_unique<SealingLine>(std::move(line), seal_);
  }
  std::string name() const override { return place_.name(); }

 private:
  SerialPort place_;
  const std::atomic<bool>& seal_;
};

/// A device in real time and its board, with a terminal between them, at 100 Hz.
struct TerminalRig {
  TerminalRig() {
    TriggerConfiguration requested;
    requested.rate_hz = 100;
    EXPECT_EQ(device.configure(requested, nullptr), DeviceStatus::ok) << device.last_error();
  }
  static std::unique_ptr<test::BoardSimulator> simulator() {
    test::BoardSimulatorOptions o;
    o.power_on = monotonic_now();
    return std::make_unique<test::BoardSimulator>(test::PulseSource{}, o);
  }
  static Options options() {
    Options o;
    o.native_usb = true;
    return o;
  }
  std::atomic<bool> seal{false};
  test::DeviceOnTerminal board{simulator()};
  Device device{std::make_unique<SealingPlace>(board.port(), seal), options()};
};

TEST(RealTime, ownerConsumerAndOnlookersDoNotMeet) {
  TerminalRig rig;
  for (int round = 0; round < 2; ++round) {
    ASSERT_EQ(rig.device.start(nullptr), DeviceStatus::ok);
    std::atomic<bool> done{false};
    std::thread onlooker([&] {
      while (!done) {
        (void)rig.device.statistics();
        (void)rig.device.board_statistics();
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

TEST(RealTime, theDevicesThreadAllocatesNothingWhileItReads) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "needs the allocation hooks, which sanitizer builds leave out";
  TerminalRig rig;
  ASSERT_EQ(rig.device.start(nullptr), DeviceStatus::ok);
  Pulse p;
  ASSERT_EQ(rig.device.wait(Duration::seconds(5), &p), DeviceStatus::ok);
  const std::uint64_t before = AllocationGuard::allocations_after_seal();
  {
    const SealedScope sealed;
    rig.seal = true;
    (void)rig.device.pause(2);
    for (int i = 0; i < 50; ++i)
      ASSERT_EQ(rig.device.wait(Duration::seconds(5), &p), DeviceStatus::ok);
    (void)rig.device.statistics();
  }
  EXPECT_EQ(AllocationGuard::allocations_after_seal(), before);
  rig.seal = false;
  ASSERT_EQ(rig.device.wait(Duration::seconds(5), &p), DeviceStatus::ok);
}

}  // namespace
}  // namespace vergence::trigger_board
