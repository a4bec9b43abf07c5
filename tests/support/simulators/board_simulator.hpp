#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "core/math/random.hpp"
#include "firmware_iface/trigger/board/board.h"
#include "tests/support/simulators/device_model.hpp"

namespace vergence::test {

/// A pulse that left the board.
struct SimulatedPulse {
  std::uint32_t boot = 0, number = 0;
  HostStamp edge{};        // its true time
  std::uint8_t lines = 0;  // mask of those that were pulsed
};

/// Exposure-active output of a camera after a pulse, by the host's clock. No earlier than
/// the edge.
struct SimulatedExposure {
  bool happens = false;
  HostStamp start{}, end{};
};
using SimulatedExposures = std::array<SimulatedExposure, trigger_max_lines>;

/// Told of every pulse as its edge is made, in order; returns what the cameras on the lines do.
/// Called by whoever reads the board's line.
using PulseSource = std::function<SimulatedExposures(const SimulatedPulse& pulse)>;

struct BoardSimulatorOptions {
  std::uint32_t baud = 921600;
  std::uint32_t counts_hz = 84'000'000;  // of its timer, by its crystal …
  double clock_ppm = 20;                 // … which is this fast against the host's clock …
  double wander_ppm = 0;                 // … and swings by this …
  Duration wander_period = Duration::seconds(600);  // … in this time
  std::uint8_t lines = 4, feedback_inputs = 4;
  bool has_pps = true, has_ins = true;
  std::array<std::uint8_t, 12> serial{0x30, 0,    0x2B, 0,    0x0B, 0x51,
                                      0x33, 0x36, 0x34, 0x39, 0x31, 0x38};
  HostStamp power_on{};
  Duration duration = Duration::seconds(7 * 86400);  // nothing is sent and no pulse made after it
  Duration boot_time = Duration::milliseconds(20);   // deaf and mute after a start
  std::vector<HostStamp>
      reboots{};     // it begins again, by itself, in mid-frame if need be; ascending
  bool pps = false;  // a GNSS receiver is wired: an edge every whole second of the host's clock
  Duration ins_interval{};  // of the INS' SyncOut; 0: not wired
  std::uint64_t seed = 1;
};

/// A trigger board at byte level: the reference firmware's own state machine on simulated hardware.
///
/// The hardware is a timer on a drifting crystal that makes pulses and stamps edges to a count, and
/// a UART. What firmware spends on the way is not simulated. Pulses go on while nobody is
/// connected.
/// Threads  As DeviceModel; the PulseSource is called on that thread.
class BoardSimulator final : public DeviceModel {
 public:
  /// `pulses` may be empty: no camera exposes.
  BoardSimulator(PulseSource pulses, const BoardSimulatorOptions& options);

  void receive(std::span<const std::uint8_t> bytes, HostStamp at) override;
  [[nodiscard]] std::optional<HostStamp> next() const override { return next_; }
  void produce(HostStamp at, std::vector<std::uint8_t>* out) override;
  [[nodiscard]] std::uint32_t baud() const override { return options_.baud; }
  void power_cycle(HostStamp at) override;
  [[nodiscard]] bool ended() const override { return ended_; }

  [[nodiscard]] std::uint32_t boot_id() const noexcept { return board_.boot_id; }
  [[nodiscard]] std::uint64_t pulses_made() const noexcept { return made_; }

 private:
  struct Edge {
    HostStamp at{};
    BoardInput input{};
    bool rising = false;
  };

  [[nodiscard]] double counts_since_power_on(HostStamp host) const noexcept;
  [[nodiscard]] std::uint64_t count_at(HostStamp host) const noexcept;
  [[nodiscard]] HostStamp host_at(std::uint64_t count) const noexcept;
  [[nodiscard]] Duration byte_time() const noexcept {
    return Duration::nanoseconds(10'000'000'000 / options_.baud);
  }
  void start(HostStamp at);
  void advance(HostStamp until);
  void serve(HostStamp at);
  void make_pulse(HostStamp at);
  void take_edge(const Edge& edge);
  void plan_edge(const Edge& edge);
  void plan_pps(HostStamp after);
  void plan();
  [[nodiscard]] HostStamp next_inside() const;

  PulseSource pulses_;
  BoardSimulatorOptions options_;
  TriggerBoard board_{};
  double zero_counts_ = 0;  // of the crystal at the board's start
  HostStamp awake_{};       // from then on it hears and speaks
  HostStamp now_{}, line_free_{}, end_;
  std::optional<BoardPulse> armed_{};
  HostStamp armed_at_{};
  std::deque<Edge> edges_;  // to come, in order
  std::size_t reboots_done_ = 0;
  int boots_ = 0;
  std::uint64_t made_ = 0;
  bool ended_ = false;
  std::optional<HostStamp> next_{};
};

}  // namespace vergence::test
