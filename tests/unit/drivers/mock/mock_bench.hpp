#pragma once
#include <gtest/gtest.h>

#include <array>
#include <optional>

#include "tests/support/small_mock.hpp"

namespace vergence::mock {

inline constexpr double kRate = 20;

inline double mean_grey(const ImageView& v) {
  double sum = 0;
  for (int y = 0; y < v.height; ++y)
    for (int x = 0; x < v.width; ++x) sum += v.at(x, y);
  return sum / (v.width * v.height);
}

struct Seen {
  Frame frame;
  // Mean grey value.
  double mean = 0;
};

/// A drive in virtual time with tiny pictures of an almost empty town, and all that its cameras and
/// its board bring; frames are released at once.
struct MockBench {
  MockBench(const std::vector<std::string>& faults, MockRigOptions options,
            const TriggerConfiguration& board = {kRate}) {
    options.noise = false;
    options.reports_read = true;
    rig = std::make_unique<MockRig>(test::small_truth(faults), options);
    for (int k = 0; k < 2; ++k)
      EXPECT_EQ(rig->camera(k).configure(test::small_camera(kRate), nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->ins().configure(120, nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->trigger().configure(board, nullptr), DeviceStatus::ok);
  }

  /// `pause_at`: asks for a pause of five pulses when the report of that pulse is read.
  void drive(std::optional<std::uint64_t> pause_at = {}) {
    EXPECT_EQ(rig->ins().start(nullptr), DeviceStatus::ok);
    for (int k = 0; k < 2; ++k) EXPECT_EQ(rig->camera(k).start(nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->trigger().start(nullptr), DeviceStatus::ok);
    std::array<bool, 4> ended{};
    while (!(ended[0] && ended[1] && ended[2] && ended[3])) {
      for (std::size_t k = 0; k < 2; ++k) ended[k] = read_frame(k) || ended[k];
      InsReading r;
      ended[2] = rig->ins().wait(Duration::microseconds(50), &r) == DeviceStatus::ended || ended[2];
      ended[3] = read_pulse(pause_at) || ended[3];
    }
    for (std::size_t k = 0; k < 2; ++k)
      statistics[k] = rig->camera(static_cast<int>(k)).statistics();
  }

  std::unique_ptr<MockRig> rig;
  std::array<std::vector<Seen>, 2> frames;
  // Number of disconnects followed by a reconnect, per camera.
  std::array<int, 2> disconnects{};
  std::array<CameraStatistics, 2> statistics;
  std::vector<Pulse> pulses;
  int board_disconnected = 0;

 private:
  /// True: it has ended.
  bool read_frame(std::size_t k) {
    CameraDevice& camera = rig->camera(static_cast<int>(k));
    Frame f;
    DeviceStatus status = camera.wait(Duration{}, &f);
    if (status == DeviceStatus::ok) {
      frames[k].push_back({f, mean_grey(camera.view(f.slot))});
      camera.release(f.slot);
    } else if (status == DeviceStatus::disconnected) {
      status = camera.start(nullptr);
      disconnects[k] += status == DeviceStatus::ok ? 1 : 0;
    }
    return status == DeviceStatus::ended;
  }
  bool read_pulse(std::optional<std::uint64_t> pause_at) {
    TriggerDevice& board = rig->trigger();
    Pulse p;
    DeviceStatus status = board.wait(Duration::microseconds(50), &p);
    if (status == DeviceStatus::ok) {
      pulses.push_back(p);
      if (pause_at && p.number == *pause_at) {
        EXPECT_EQ(board.pause(5), DeviceStatus::ok);
        EXPECT_EQ(board.pause(5), DeviceStatus::ok) << "one is under way: nothing more";
      }
    } else if (status == DeviceStatus::disconnected) {
      if (!board_is_disconnected_) {
        ++board_disconnected;
        EXPECT_EQ(board.pause(5), DeviceStatus::disconnected);
      }
      status = board.start(nullptr);
      board_is_disconnected_ = status != DeviceStatus::ok;
    }
    return status == DeviceStatus::ended;
  }

  bool board_is_disconnected_ = false;
};

}  // namespace vergence::mock
