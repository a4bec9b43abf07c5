#pragma once
#include <map>

#include "drivers/trigger_board/trigger_board.hpp"
#include "tests/unit/drivers/conformance/serial_conformance.hpp"

namespace vergence::test {

/// A frame taken apart; type 0: it is none.
[[nodiscard]] inline TriggerFrame opened(const std::vector<std::uint8_t>& bytes) {
  TriggerDecoder decoder{};
  TriggerFrame frame{};
  for (const std::uint8_t b : bytes)
    if (trigger_decode(&decoder, b, &frame) == trigger_frame_ready) return frame;
  return {};
}
[[nodiscard]] inline std::vector<std::uint8_t> closed(const TriggerFrame& frame) {
  std::vector<std::uint8_t> bytes(trigger_max_frame);
  bytes.resize(
      trigger_write_frame(frame.type, frame.sequence, frame.payload, frame.size, bytes.data()));
  return bytes;
}

/// A line without a converter: the board's own USB, or a UART of the host.
[[nodiscard]] inline SimulatedLineOptions direct_line() { return {.converter = false}; }
[[nodiscard]] inline BoardSimulatorOptions board_for(Duration duration) {
  return {.duration = duration};
}
[[nodiscard]] inline TriggerConfiguration thirty_hertz() { return {.rate_hz = 30}; }

/// A driver's device on a simulated line to a simulated board, and what the board really did.
struct BoardRig {
  explicit BoardRig(const BoardSimulatorOptions& board = {}, const SimulatedLineOptions& line = {},
                    const trigger_board::Options& options = {}, Tampered::Tamper tamper = {})
      : simulator(std::make_shared<BoardSimulator>(
            [this](const SimulatedPulse& p) {
              edges[{p.boot, p.number}] = p.edge;
              return exposures ? exposures(p) : SimulatedExposures{};
            },
            board)) {
    between = std::make_shared<Tampered>(simulator, std::move(tamper));
    auto owned = std::make_unique<SimulatedLinkFactory>(between, line);
    place = owned.get();
    device = std::make_unique<trigger_board::Device>(std::move(owned), options);
  }

  // Edges by boot and number; used by the device's thread while it runs.
  std::map<std::pair<std::uint32_t, std::uint64_t>, HostStamp> edges;
  PulseSource exposures;
  std::shared_ptr<BoardSimulator> simulator;
  std::shared_ptr<Tampered> between;
  SimulatedLinkFactory* place = nullptr;
  std::unique_ptr<trigger_board::Device> device;
  int disconnects = 0;

  /// Configured and started.
  void start(const TriggerConfiguration& requested = thirty_hertz()) {
    ASSERT_EQ(device->configure(requested, nullptr), DeviceStatus::ok) << device->last_error();
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
  }
  /// Pulses until the device has no more, or this many, each stamped within its bound;
  /// `disconnected` is passed over.
  std::vector<Pulse> pulses(std::size_t most = SIZE_MAX) {
    const auto all = all_of<Pulse>(*device, most, &disconnects);
    EXPECT_FALSE(all.empty());
    for (const Pulse& p : all) {
      EXPECT_TRUE(p.mapped);
      EXPECT_LE(std::abs((p.host - truth(p)).ns()), p.host_error.ns()) << p.number;
      if (::testing::Test::HasFailure()) break;
    }
    return all;
  }
  /// All pulses of the board's time.
  std::vector<Pulse> drive(const TriggerConfiguration& requested = thirty_hertz()) {
    start(requested);
    return pulses();
  }
  [[nodiscard]] HostStamp truth(const Pulse& p) const { return edges.at({p.boot, p.number}); }
};

}  // namespace vergence::test
