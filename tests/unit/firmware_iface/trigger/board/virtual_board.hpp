#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "firmware_iface/trigger/board/board.h"

namespace vergence {

/// The portable firmware in virtual time: hardware that makes every pulse on its count, a host
/// without latency. Runs from event to event, so a day costs what happens in it.
class VirtualBoard {
 public:
  using Bytes = std::vector<std::uint8_t>;
  static constexpr std::uint32_t kHz = 84'000'000;
  static constexpr std::uint32_t kBootId = 0xB0071D00;

  explicit VirtualBoard(BoardDescription description = usual(), std::uint64_t start = 1'000'000)
      : now(start) {
    board_init(&board, &description, kBootId, now);
  }

  static BoardDescription usual() {
    return {kHz, 200, 1'000'000, 4, 2, true, true, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}};
  }

  static TriggerConfig config(std::uint32_t millihertz) {
    return {millihertz, 200, 0, 0x3, 0, 0, 0, 0, 0};
  }

  void bytes(const Bytes& sent) {
    for (const std::uint8_t b : sent) {
      board_receive(&board, now, now, b);
      hardware();
    }
  }
  void send(std::uint8_t type, const Bytes& payload = {}) {
    bytes(framed(type, ++sequence, payload));
  }
  static Bytes framed(std::uint8_t type, std::uint8_t sequence, const Bytes& payload) {
    Bytes out(trigger_max_frame);
    out.resize(trigger_write_frame(type, sequence, payload.data(), payload.size(), out.data()));
    return out;
  }
  void configure(const TriggerConfig& c) {
    Bytes payload(trigger_config_payload_size);
    trigger_put_config(&c, payload.data());
    send(trigger_config, payload);
  }
  void start(std::uint32_t millihertz) {
    configure(config(millihertz));
    send(trigger_start);
  }
  void pause(std::uint32_t pulses) {
    Bytes payload(trigger_pause_payload_size);
    (void)trigger_put_bytes(payload.data(), pulses, 4);
    send(trigger_pause, payload);
  }
  /// A level change to come.
  void edge_at(std::uint64_t count, BoardInput input, bool rising) {
    edges.emplace(count, std::pair{input, rising});
  }

  void run_until(std::uint64_t until) {
    while (now < until) {
      hardware();
      std::uint64_t next = std::min(until, board_deadline(&board));
      if (armed) next = std::min(next, pulse.count);
      if (!edges.empty()) next = std::min(next, edges.begin()->first);
      now = std::max(next, now + 1);
      if (armed && pulse.count <= now) {
        armed = false;
        made.push_back(pulse);
        if (on_pulse) on_pulse(pulse);
        board_pulse_made(&board, now, pulse.count, false);
      }
      while (!edges.empty() && edges.begin()->first <= now) {
        const auto [count, edge] = *edges.begin();
        edges.erase(edges.begin());
        board_edge(&board, now, edge.first, edge.second, count);
      }
    }
    hardware();
  }
  void run_for_us(std::uint64_t us) { run_until(now + us * kHz / 1'000'000); }

  /// Decoded messages of the board; `deaf`: the line is stuck.
  void listen() {
    std::uint8_t out[trigger_max_frame];
    for (std::size_t size = 0; !deaf && (size = board_send(&board, now, out)) > 0;)
      for (std::size_t i = 0; i < size; ++i) {
        TriggerFrame frame{};
        if (trigger_decode(&host, out[i], &frame) == trigger_frame_ready) frames.push_back(frame);
      }
  }

  std::vector<TriggerFrame> pop(std::uint8_t type) {
    std::vector<TriggerFrame> popped;
    for (const TriggerFrame& f : frames)
      if (f.type == type) popped.push_back(f);
    frames.clear();
    return popped;
  }
  std::vector<TriggerEvent> events() {
    std::vector<TriggerEvent> all;
    for (const TriggerFrame& f : pop(trigger_event))
      trigger_get_event(f.payload, f.size, &all.emplace_back());
    return all;
  }
  /// The newest STATUS; forgets the other frames.
  TriggerStatus status() {
    TriggerStatus s{};
    for (const TriggerFrame& f : pop(trigger_status)) trigger_get_status(f.payload, f.size, &s);
    return s;
  }
  /// Code of the newest ERROR; 0: none.
  int error() {
    int code = 0;
    for (const TriggerFrame& f : pop(trigger_error)) code = f.payload[1];
    return code;
  }

  TriggerBoard board{};
  std::uint64_t now = 0;
  std::uint8_t sequence = 0;
  bool deaf = false;
  bool armed = false;
  BoardPulse pulse{};
  std::vector<BoardPulse> made;
  std::function<void(const BoardPulse&)> on_pulse;
  std::vector<TriggerFrame> frames;
  std::multimap<std::uint64_t, std::pair<BoardInput, bool>> edges;
  TriggerDecoder host{};

 private:
  void hardware() {
    board_poll(&board, now);
    if (board_wants_disarm(&board)) {
      armed = false;
      board_pulse_disarmed(&board, now);
    }
    if (!armed && board_schedule_pulse(&board, now, &pulse)) armed = true;
    listen();
  }
};

}  // namespace vergence
