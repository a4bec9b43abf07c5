#include "app/device_replay/recorded_board.hpp"

#include <utility>

#include "drivers/trigger_board/pause_request.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::app {
namespace {

using Kind = LineEvent::Kind;

/// What the driver knew about its pauses, followed through the record: requests are told from what
/// it sent again by the same rules.
class PauseReader {
 public:
  void pass_time(HostStamp now) noexcept { (void)request_.due(now); }

  void received(std::span<const std::uint8_t> bytes) noexcept {
    TriggerFrame frame;
    for (const std::uint8_t byte : bytes)
      if (trigger_decode(&from_board_, byte, &frame) == trigger_frame_ready) take(frame);
  }

  /// How many more pulses the driver had been asked to leave out when it wrote this.
  [[nodiscard]] std::uint32_t written(std::span<const std::uint8_t> bytes, HostStamp now) noexcept {
    TriggerDecoder decoder{};  // a write is whole frames
    TriggerFrame frame;
    std::uint32_t added = 0;
    for (const std::uint8_t byte : bytes) {
      TriggerPause pause;
      if (trigger_decode(&decoder, byte, &frame) != trigger_frame_ready ||
          frame.type != trigger_pause ||
          !trigger_get_pause(frame.payload, static_cast<std::size_t>(frame.size), &pause))
        continue;
      const std::uint32_t open = request_.unanswered();
      if (pause.pulses > open) {
        added += pause.pulses - open;
        request_.add(pause.pulses - open);
      }
      (void)request_.due(now);
      request_.sent(frame.sequence, now);
    }
    return added;
  }

 private:
  void take(const TriggerFrame& frame) noexcept {
    const auto size = static_cast<std::size_t>(frame.size);
    TriggerInfo info;
    TriggerError error;
    if (frame.type == trigger_status) {
      request_.answered(frame.sequence);
    } else if (frame.type == trigger_error && trigger_get_error(frame.payload, size, &error)) {
      if (error.refused == trigger_pause) request_.refused();
    } else if (frame.type == trigger_info && trigger_get_info(frame.payload, size, &info)) {
      if (info.boot_id != boot_) request_.restart();
      boot_ = info.boot_id;
    }
  }

  trigger_board::PauseRequest request_;
  TriggerDecoder from_board_{};
  std::uint32_t boot_ = 0;
};

}  // namespace

std::vector<RequestedPause> requested_pauses(const LineRecord& record) {
  std::vector<RequestedPause> all;
  PauseReader reader;
  for (std::size_t i = 0; i < record.steps.size(); ++i) {
    const LineRecord::Step& step = record.steps[i];
    const HostStamp now = step.event.time;
    if (step.event.kind == Kind::written) {
      if (const std::uint32_t pulses = reader.written(record.bytes_of(step), now); pulses > 0)
        all.push_back({i, pulses});
      continue;
    }
    if (step.event.kind == Kind::read) reader.received(record.bytes_of(step));
    reader.pass_time(now);
  }
  return all;
}

RecordedBoard::RecordedBoard(std::unique_ptr<TriggerDevice> board, const LineRecord& record,
                             RecordedPlace& line)
    : pauses_(requested_pauses(record)), board_(std::move(board)) {
  line.before_writes([this](std::size_t step) {
    while (next_ < pauses_.size() && pauses_[next_].step < step) ++next_;
    if (next_ < pauses_.size() && pauses_[next_].step == step)
      (void)board_->pause(pauses_[next_++].pulses);
  });
}

}  // namespace vergence::app
