#pragma once
#include <array>
#include <deque>
#include <functional>

#include "firmware_iface/trigger/board/board.h"
#include "tests/support/simulators/device_model.hpp"

namespace vergence::test {

/// A pulse that left the board.
struct SimulatedPulse {
  std::uint32_t boot = 0, number = 0;
  /// Its true time.
  HostStamp edge{};
  /// Mask of the lines that were pulsed.
  std::uint8_t lines = 0;
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
  /// Rate of its timer, by its crystal.
  std::uint32_t counts_hz = 84'000'000;
  /// The crystal is this fast against the host's clock, and swings by `wander_ppm` in
  /// `wander_period`.
  double clock_ppm = 20;
  double wander_ppm = 0;
  Duration wander_period = Duration::seconds(600);
  std::uint8_t lines = 4, feedback_inputs = 4;
  bool has_pps = true, has_ins = true;
  std::array<std::uint8_t, 12> serial{0x30, 0,    0x2B, 0,    0x0B, 0x51,
                                      0x33, 0x36, 0x34, 0x39, 0x31, 0x38};
  HostStamp power_on{};
  /// Nothing is sent and no pulse made after it.
  Duration duration = Duration::seconds(7 * 86400);
  /// Deaf and mute so long after a start.
  Duration boot_time = Duration::milliseconds(20);
  /// It begins again, by itself, in mid-frame if need be; ascending.
  std::vector<HostStamp> reboots{};
  /// A GNSS receiver is wired: an edge every whole second of the host's clock.
  bool pps = false;
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
  /// Count of the crystal at the board's start.
  double zero_counts_ = 0;
  /// From then on it hears and speaks.
  HostStamp awake_{};
  HostStamp now_{}, line_free_{}, end_;
  std::optional<BoardPulse> armed_{};
  HostStamp armed_at_{};
  /// Edges to come, in order.
  std::deque<Edge> edges_;
  std::size_t reboots_done_ = 0;
  int boots_ = 0;
  std::uint64_t made_ = 0;
  bool ended_ = false;
  std::optional<HostStamp> next_{};
};

}  // namespace vergence::test
