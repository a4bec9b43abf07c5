#include <gtest/gtest.h>

#include <atomic>
#include <chrono>

#include "core/memory/allocation_guard.hpp"
#include "drivers/serial/serial.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

/// A simulated board in real time at the far end of a pipe within the process.
class BoardOnPipe {
 public:
  BoardOnPipe(std::unique_ptr<mock::BoardSimulator> board, std::unique_ptr<ByteLine> end)
      : board_(std::move(board)), end_(std::move(end)) {
    thread_ = std::thread([this] { work(); });
  }
  BoardOnPipe(const BoardOnPipe&) = delete;
  BoardOnPipe& operator=(const BoardOnPipe&) = delete;
  ~BoardOnPipe() {
    stop_ = true;
    thread_.join();
  }

 private:
  void work() {
    std::array<std::uint8_t, 512> in{};
    while (!stop_) {
      std::vector<std::uint8_t> out;
      for (auto next = board_->next(); next && *next <= end_->now(); next = board_->next())
        board_->produce(end_->now(), &out);
      if (!out.empty()) (void)end_->write(out, Duration{});
      const LineRead r = end_->read(in, Duration::milliseconds(1));
      if (r.status == DeviceStatus::ok) board_->receive(std::span(in).first(r.size), end_->now());
      if (r.status == DeviceStatus::gone) return;
    }
  }
  std::unique_ptr<mock::BoardSimulator> board_;
  std::unique_ptr<ByteLine> end_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

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

/// A place with one line in it.
class OneLine final : public LinePlace {
 public:
  explicit OneLine(std::unique_ptr<ByteLine> line) : line_(std::move(line)) {}
  std::unique_ptr<ByteLine> open(const LineSettings&, DeviceStatus* status) override {
    *status = line_ ? DeviceStatus::ok : DeviceStatus::not_found;
    return std::move(line_);
  }
  std::string name() const override { return "pipe"; }

 private:
  std::unique_ptr<ByteLine> line_;
};

struct PipeRig {
  explicit PipeRig(const std::atomic<bool>& seal = never()) {
    auto ends = make_byte_pipe();
    mock::BoardSimulatorOptions o;
    o.power_on = ends.first->now();
    board = std::make_unique<BoardOnPipe>(
        std::make_unique<mock::BoardSimulator>(mock::PulseSource{}, o), std::move(ends.second));
    Options options;
    options.native_usb = true;
    device = std::make_unique<Device>(
        std::make_unique<OneLine>(std::make_unique<SealingLine>(std::move(ends.first), seal)),
        options);
  }
  static const std::atomic<bool>& never() {
    static const std::atomic<bool> no{false};
    return no;
  }
  std::unique_ptr<BoardOnPipe> board;
  std::unique_ptr<Device> device;
};

TriggerConfiguration hundred_hertz() {
  TriggerConfiguration c;
  c.rate_hz = 100;
  return c;
}

TEST(RealTime, ownerConsumerAndOnlookersDoNotMeet) {
  PipeRig rig;
  ASSERT_EQ(rig.device->configure(hundred_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  for (int round = 0; round < 2; ++round) {
    ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
    std::atomic<bool> done{false};
    std::thread onlooker([&] {
      while (!done) {
        (void)rig.device->statistics();
        (void)rig.device->board_statistics();
        (void)rig.device->timing();
        (void)rig.device->pause(1);
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
      }
    });
    std::uint64_t last = 0;
    int taken = 0;
    std::thread consumer([&] {
      Pulse p;
      for (;;) {
        const DeviceStatus s = rig.device->wait(Duration::seconds(5), &p);
        if (s != DeviceStatus::ok) break;
        if (taken++ > 0 && p.number <= last) ADD_FAILURE() << p.number << " after " << last;
        last = p.number;
        if (!p.mapped || p.host > p.arrival + p.host_error)
          ADD_FAILURE() << "an edge after its report";
      }
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    rig.device->stop();
    done = true;
    consumer.join();
    onlooker.join();
    EXPECT_GT(taken, 5);
  }
}

TEST(RealTime, aLineThatIsCutIsGoneAndStopsAtOnce) {
  PipeRig rig;
  ASSERT_EQ(rig.device->configure(hundred_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  Pulse p;
  ASSERT_EQ(rig.device->wait(Duration::seconds(5), &p), DeviceStatus::ok);
  rig.board.reset();
  DeviceStatus s = DeviceStatus::ok;
  while (s == DeviceStatus::ok) s = rig.device->wait(Duration::seconds(5), &p);
  EXPECT_EQ(s, DeviceStatus::gone);
  EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::gone) << "and does not wait";
  rig.device->stop();
  EXPECT_EQ(rig.device->wait(Duration{}, &p), DeviceStatus::stopped);
}

TEST(RealTime, theDevicesThreadAllocatesNothingWhileItReads) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "needs the allocation hooks, which sanitizer builds leave out";
  std::atomic<bool> seal{false};
  PipeRig rig(seal);
  ASSERT_EQ(rig.device->configure(hundred_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  Pulse p;
  ASSERT_EQ(rig.device->wait(Duration::seconds(5), &p), DeviceStatus::ok);
  const std::uint64_t before = AllocationGuard::allocations_after_seal();
  {
    const SealedScope sealed;
    seal = true;
    (void)rig.device->pause(2);
    for (int i = 0; i < 50; ++i)
      ASSERT_EQ(rig.device->wait(Duration::seconds(5), &p), DeviceStatus::ok);
    (void)rig.device->statistics();
  }
  EXPECT_EQ(AllocationGuard::allocations_after_seal(), before);
  seal = false;
  ASSERT_EQ(rig.device->wait(Duration::seconds(5), &p), DeviceStatus::ok);
}

}  // namespace
}  // namespace vergence::trigger_board
