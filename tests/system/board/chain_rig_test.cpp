// The whole chain inside the rig's kernel: the board's firmware behind ftdi_sio makes pulses,
// emulated cameras on USB expose at them, and what comes out as a pair is held against what the
// cameras wrote into the images.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "app/runtime/live_source.hpp"
#include "drivers/iidc/iidc.hpp"
#include "drivers/trigger_board/trigger_board.hpp"
#include "tests/system/board/board_rig.hpp"
#include "tests/system/iidc/iidc_rig.hpp"

namespace vergence::test {
namespace {

constexpr double kRate = 15;
constexpr Duration kExposure = Duration::milliseconds(4);

/// Board, cameras and what connects them; pairs are counted as they come out.
class Chain {
 public:
  Chain()
      : cameras_("sim_usb_iidc", {"--cameras", "2"}),
        board_([this](const mock::SimulatedPulse& pulse) { return trigger(pulse); }) {}

  /// Opens, configures and starts all of it.
  void start() {
    CameraConfiguration requested = usual(CameraTrigger::hardware);
    requested.rate_hz = 30;
    requested.exposure = kExposure;
    ASSERT_TRUE(await_cameras(usb_.get(), 2));
    for (unsigned k = 0; k < 2; ++k) devices_.push_back(open_camera(usb_.get(), k, requested));
    ASSERT_TRUE(devices_[0] != nullptr && devices_[1] != nullptr);
    trigger_board::Driver boards;
    DeviceStatus status = DeviceStatus::ok;
    for (int i = 0; i < 50 && board_device_ == nullptr; ++i) {
      board_device_ = boards.open_board("", &status);
      if (board_device_ == nullptr) std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    ASSERT_NE(board_device_, nullptr) << boards.last_error();
    TriggerConfiguration pulses;
    pulses.rate_hz = kRate;
    pulses.vary = Duration::milliseconds(4);
    pulses.feedback = 0x03;
    ASSERT_EQ(board_device_->configure(pulses, nullptr), DeviceStatus::ok)
        << board_device_->last_error();

    app::LiveSource::Options o;
    o.sync.mode = SyncMode::board;
    o.sync.interval = Duration::seconds(1 / kRate);
    o.sync.hold =
        Duration::milliseconds(300);  // one processor is shared by emulators, kernel and test
    ASSERT_EQ(o.sync.validate(), nullptr) << o.sync.validate();
    source_ = std::make_unique<app::LiveSource>(
        std::vector<CameraDevice*>{devices_[0].get(), devices_[1].get()}, nullptr,
        board_device_.get(), o);
    source_->start();
    consumer_ = std::thread([this] { consume(); });
  }
  ~Chain() { finish(); }

  void finish() {
    if (source_ == nullptr || !consumer_.joinable()) return;
    source_->stop();
    consumer_.join();
    source_->join();
  }
  /// Until so many more pairs have come. False: they did not in 30 s.
  bool await_pairs(int more) {
    const int until = pairs + more;
    for (int i = 0; i < 3000; ++i) {
      if (pairs >= until) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  Emulator& cameras() { return cameras_; }
  [[nodiscard]] const app::LiveCounters& counters() const { return source_->counters(); }

  std::atomic<int> pairs{0}, wrong{0}, outside{0}, unreported{0}, gone{0}, back{0};

 private:
  mock::SimulatedExposures trigger(const mock::SimulatedPulse& pulse) {
    cameras_.command("trigger " + std::to_string(pulse.edge.ns()));
    mock::SimulatedExposures e{};
    for (std::size_t k = 0; k < 2; ++k) e[k] = {true, pulse.edge, pulse.edge + kExposure};
    return e;
  }
  void consume() {
    for (app::LiveItem item; source_->next(&item);) {
      gone += item.kind == app::LiveItem::Kind::device_gone;
      back += item.kind == app::LiveItem::Kind::device_back;
      if (item.kind != app::LiveItem::Kind::images) continue;
      if (item.set.complete) {
        const ImageStamp left = read_stamp(source_->image(item.set, 0)),
                         right = read_stamp(source_->image(item.set, 1));
        // Both cameras were given the very same time of the edge.
        wrong += !left.valid || !right.valid || left.middle_ns != right.middle_ns ||
                 item.set.proof != SyncProof::numbered;
        outside += std::abs(item.set.stamp.ns() - left.middle_ns) > item.set.error.ns();
        unreported += !item.set.reported;
        ++pairs;
      }
      source_->release(item.set);
    }
  }

  Emulator cameras_;
  BoardBehindConverter board_;
  std::unique_ptr<CameraDriver> usb_ = iidc::make_usb_driver();
  std::vector<std::unique_ptr<CameraDevice>> devices_;
  std::unique_ptr<trigger_board::Device> board_device_;
  std::unique_ptr<app::LiveSource> source_;
  std::thread consumer_;
};

TEST(BoardChain, PairsArePulsesWhateverIsMissedOrLost) {
  if (!inside_rig()) GTEST_SKIP() << "this test runs inside the rig's kernel: ctest -L rig";
  Chain chain;
  ASSERT_NO_FATAL_FAILURE(chain.start());
  ASSERT_TRUE(chain.await_pairs(30));
  chain.cameras().command("miss 1 2");  // two pulses that the right camera does not see
  ASSERT_TRUE(chain.await_pairs(20));
  chain.cameras().command("drop 0 1");  // an image of the left one that is lost on the wire
  ASSERT_TRUE(chain.await_pairs(20));
  chain.cameras().command("tear 1 1");
  ASSERT_TRUE(chain.await_pairs(20));
  chain.finish();
  const SyncCounters& c = chain.counters().sync;
  EXPECT_EQ(chain.wrong, 0);
  EXPECT_EQ(chain.outside, 0) << "every stamp is within its bound";
  EXPECT_GE(c.missed_trigger[1], 2U);
  EXPECT_EQ(c.missed_trigger[0], 0U);
  EXPECT_GE(c.lost[0], 1U);
  EXPECT_GE(c.lost[1], 1U) << "the torn one";
  EXPECT_EQ(c.contradictions[0] + c.contradictions[1], 0U);
  EXPECT_EQ(c.acquisitions[0], 1U);
  EXPECT_EQ(c.acquisitions[1], 1U);
}

TEST(BoardChain, ACameraThatWasUnpluggedIsProvenAnewWhileTheOtherGoesOn) {
  if (!inside_rig()) GTEST_SKIP() << "this test runs inside the rig's kernel: ctest -L rig";
  Chain chain;
  ASSERT_NO_FATAL_FAILURE(chain.start());
  ASSERT_TRUE(chain.await_pairs(20));
  chain.cameras().command("unplug 1");
  for (int i = 0; i < 1500 && chain.gone == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(chain.gone, 1);
  chain.cameras().command("replug 1");
  ASSERT_TRUE(chain.await_pairs(30));
  chain.finish();
  const SyncCounters& c = chain.counters().sync;
  EXPECT_EQ(chain.back, 1);
  EXPECT_EQ(chain.wrong, 0);
  EXPECT_EQ(chain.outside, 0);
  EXPECT_EQ(c.acquisitions[0], 1U) << "the other one went on";
  EXPECT_EQ(c.acquisitions[1], 2U);
  EXPECT_EQ(c.reboots, 0U);
}

}  // namespace
}  // namespace vergence::test
