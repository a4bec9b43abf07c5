#include <algorithm>
#include <cstdint>
#include <cstring>

#include "firmware_iface/trigger/board/board.h"
#include "tests/fuzz/require.hpp"

namespace vergence {
namespace {

using test::require;

/// Encoding a decoded message must give the same bytes.
void probe_decoder(const std::uint8_t* data, std::size_t size) {
  TriggerDecoder decoder{};
  TriggerFrame frame{};
  for (std::size_t i = 0; i < size; ++i) {
    const TriggerDecoder before = decoder;
    const TriggerDecodeStatus status = trigger_decode(&decoder, data[i], &frame);
    require(decoder.used <= sizeof decoder.buffer, "the decoder stays in its buffer");
    require(status == trigger_wait || (data[i] == 0 && decoder.used == 0),
            "only 00 ends a frame, and the next begins again");
    require(before.frames + before.bad_coding + before.bad_length + before.bad_crc +
                    (status == trigger_wait ? 0U : 1U) ==
                decoder.frames + decoder.bad_coding + decoder.bad_length + decoder.bad_crc,
            "every frame is counted once");
    if (status != trigger_frame_ready) continue;
    require(frame.size <= trigger_max_payload, "payloads have their limit");
    std::uint8_t again[trigger_max_frame];
    TriggerDecoder other{};
    TriggerFrame copy{};
    const std::size_t n =
        trigger_write_frame(frame.type, frame.sequence, frame.payload, frame.size, again);
    TriggerDecodeStatus last = trigger_wait;
    for (std::size_t k = 0; k < n; ++k) last = trigger_decode(&other, again[k], &copy);
    require(last == trigger_frame_ready && copy.type == frame.type &&
                copy.sequence == frame.sequence && copy.size == frame.size &&
                std::memcmp(copy.payload, frame.payload, frame.size) == 0,
            "what is written is read");
  }
}

class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}
  [[nodiscard]] bool empty() const { return at_ == end_; }
  std::uint8_t byte() { return empty() ? 0 : *at_++; }
  std::uint32_t word() {
    std::uint32_t w = 0;
    for (int i = 0; i < 4; ++i) w = (w << 8U) | byte();
    return w;
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

class Bench {
 public:
  explicit Bench(Script script) : script_(script) {
    const BoardDescription description{84'000'000, 200, 1'000'000, 4, 2, true, true, {}};
    board_init(&board_, &description, 7, now_);
  }

  void run() {
    if (script_.byte() % 4 != 0) begin();
    while (!script_.empty()) {
      step(script_.byte() % 8);
      board_poll(&board_, now_);
      check();
    }
  }

 private:
  void receive(std::uint8_t byte) { board_receive(&board_, now_, now_, byte); }

  /// As a host would: 100 Hz, feedback and PPS, and off.
  void begin() {
    const std::uint8_t dither_us = script_.byte(), inputs = script_.byte() % 4;
    const TriggerConfig config{
        100'000, 100, dither_us, 0x3, 0, inputs, 0, trigger_edge_rising, trigger_edge_falling};
    std::uint8_t payload[trigger_config_payload_size], frame[trigger_max_frame];
    trigger_put_config(&config, payload);
    std::size_t n = trigger_write_frame(trigger_config, 0, payload, sizeof payload, frame);
    for (std::size_t i = 0; i < n; ++i) receive(frame[i]);
    n = trigger_write_frame(trigger_start, 1, nullptr, 0, frame);
    for (std::size_t i = 0; i < n; ++i) receive(frame[i]);
    require(board_.state == trigger_running, "a good configuration runs");
  }

  void message() {
    std::uint8_t payload[trigger_max_payload], frame[trigger_max_frame];
    constexpr std::uint8_t kSizes[] = {0,
                                       1,
                                       trigger_config_payload_size,
                                       0,
                                       0,
                                       trigger_pause_payload_size,
                                       trigger_ping_payload_size};
    const std::uint8_t type = script_.byte() % 8;
    const auto requested = static_cast<std::uint8_t>(
        type < sizeof kSizes ? kSizes[type] : script_.byte() % trigger_max_payload);
    for (std::uint8_t i = 0; i < requested; ++i) payload[i] = script_.byte();
    if (type == trigger_config)
      payload[3] = 0, payload[2] &= 0xFU, payload[6] = payload[7] = payload[10] = payload[11] = 0;
    const std::size_t n = trigger_write_frame(type, script_.byte(), payload, requested, frame);
    for (std::size_t i = 0; i < n; ++i) receive(frame[i]);
  }

  void step(unsigned what) {
    switch (what) {
      case 0:
        for (std::uint8_t n = script_.byte() % 32; n > 0; --n) receive(script_.byte());
        return;
      case 1:
        message();
        return;
      case 2:
        now_ += script_.word() >> (script_.byte() % 32);
        return;
      case 3: {
        const auto input = static_cast<BoardInput>(script_.byte() % 4);
        const std::uint64_t age = script_.word() >> (script_.byte() % 32);
        board_edge(&board_, now_, input, script_.byte() % 2 == 0, now_ > age ? now_ - age : 0);
        return;
      }
      case 4:
        if (armed_) now_ = std::max(now_, pulse_.count);
        board_pulse_made(&board_, now_, armed_ ? pulse_.count : now_, script_.byte() % 4 == 0);
        armed_ = false;
        return;
      case 5:
        if (board_wants_disarm(&board_)) {
          require(armed_, "only what is armed is taken back");
          armed_ = false;
          board_pulse_disarmed(&board_, now_);
        }
        return;
      case 6:
        take();
        return;
      default:
        send();
        return;
    }
  }

  void take() {
    BoardPulse pulse{};
    if (!board_schedule_pulse(&board_, now_, &pulse)) return;
    require(!armed_, "one pulse at a time");
    require(pulse.count >= now_ + 84 * board_lead_us && pulse.count <= now_ + 84'000'000 / 4,
            "pulses are armed in time, not long ahead");
    require(pulse.width > 0 && pulse.lines != 0, "pulses are some");
    if (script_.byte() % 8 == 0) {
      board_pulse_refused(&board_);
      return;
    }
    pulse_ = pulse;
    armed_ = true;
  }

  void send() {
    std::uint8_t out[trigger_max_frame];
    const std::size_t size = board_send(&board_, now_, out);
    TriggerFrame frame{};
    TriggerDecodeStatus status = trigger_wait;
    for (std::size_t i = 0; i < size; ++i) status = trigger_decode(&host_, out[i], &frame);
    require(size == 0 || status == trigger_frame_ready, "the board's frames are whole");
    TriggerEvent event{};
    if (size == 0 || frame.type != trigger_event) return;
    require(trigger_get_event(frame.payload, frame.size, &event), "an EVENT has its size");
    require(static_cast<std::int64_t>(event.pulse) > last_pulse_, "numbers only grow");
    last_pulse_ = event.pulse;
  }

  void check() {
    require(board_.outbox.used <= outbox_capacity && board_.outbox.first < outbox_capacity,
            "the outbox keeps its size");
    require(board_.state <= trigger_paused, "a state is one of three");
    const std::uint64_t tick = board_tick(&board_, now_);
    require(tick >= tick_, "ticks never go back");
    tick_ = tick;
    (void)board_deadline(&board_);
  }

  Script script_;
  TriggerBoard board_{};
  TriggerDecoder host_{};
  std::uint64_t now_ = 1000;
  std::uint64_t tick_ = 0;
  std::int64_t last_pulse_ = -1;
  bool armed_ = false;
  BoardPulse pulse_{};
};

}  // namespace
}  // namespace vergence

/// Takes bytes as a stream from the line, then as a script of what may happen to a trigger board:
/// bytes, time, edges, pulses made, refused and taken back. Aborts with a message when the
/// protocol's decoder or the board breaks a promise. Entry point of libFuzzer.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vergence::probe_decoder(data, size);
  vergence::Bench(vergence::Script(data, size)).run();
  return 0;
}
