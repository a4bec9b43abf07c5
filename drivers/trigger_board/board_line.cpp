#include "drivers/trigger_board/board_line.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace vergence::trigger_board {

void BoardLine::attach(SerialLink* line) noexcept {
  refused_before_ = refused();
  decoder_ = {};
  line_ = line;
  used_ = size_ = 0;
  into_frame_ = 0;
  bounded_ = false;
  reset();
}

void BoardLine::record_byte(std::uint8_t byte) noexcept {
  // The 00 belongs to the frame that it ends; a separate one belongs to none.
  if (byte != 0 || into_frame_ > 0) ++into_frame_;
}

/// Bounds the departure: the bytes so far were sent before this read arrived.
void BoardLine::record_end_of_read() noexcept {
  if (into_frame_ == 0) return;
  const HostStamp bound = arrival_ - byte_time_ * into_frame_;
  departure_ = bounded_ ? std::min(departure_, bound) : bound;
  bounded_ = true;
}

DeviceStatus BoardLine::send(std::uint8_t type, std::span<const std::uint8_t> payload,
                             std::uint8_t* sequence) noexcept {
  constexpr Duration kWrite = Duration::milliseconds(50);
  if (sequence != nullptr) *sequence = sequence_;
  // The first 00 ends a frame that an earlier program left incomplete.
  std::array<std::uint8_t, trigger_max_frame + 1> frame{};
  const std::size_t size =
      trigger_write_frame(type, sequence_, payload.data(), payload.size(), frame.data() + 1);
  sequence_ = static_cast<std::uint8_t>((sequence_ + 1U) % trigger_unasked);
  return line_->write(std::span(frame).first(size + 1), kWrite);
}

DeviceStatus BoardLine::next(HostStamp deadline, TriggerFrame* frame, Times* times) noexcept {
  // Ends at the deadline, or one read later.
  for (bool last = false;;) {
    while (used_ < size_) {
      const std::uint8_t byte = buffer_[used_++];
      const bool ready = trigger_decode(&decoder_, byte, frame) == trigger_frame_ready;
      record_byte(byte);
      // The end of the frame is a bound, wherever it is in the read.
      if (used_ == size_ || ready) record_end_of_read();
      const HostStamp departure = departure_;
      if (byte == 0) {
        into_frame_ = 0;
        bounded_ = false;
      }
      if (!ready) continue;
      ++frames_received_;
      *times = {arrival_, departure};
      return DeviceStatus::ok;
    }
    if (last) return DeviceStatus::timeout;
    const HostStamp now = line_->now();
    last = now >= deadline;
    const LineRead r = line_->read(buffer_, last ? Duration{} : deadline - now);
    if (r.status != DeviceStatus::ok) return r.status;
    used_ = 0;
    size_ = r.size;
    arrival_ = r.arrival;
    remember();
  }
}

void BoardLine::remember() noexcept {
  const std::size_t n = std::min(size_, first_bytes_.size() - first_size_);
  std::memcpy(first_bytes_.data() + first_size_, buffer_.data(), n);
  first_size_ += n;
}

void BoardLine::reset() noexcept {
  first_size_ = 0;
  frames_received_ = 0;
}

std::string BoardLine::received_instead() const {
  const std::string_view received(first_bytes_.data(), first_size_);
  if (received.empty() || frames_received_ > 0) return {};
  if (received.find("\xFA\xFF") != std::string_view::npos)
    return "it sends Xbus messages, like an XSens INS";
  if (received.find("$G") != std::string_view::npos)
    return "it sends NMEA 0183, like a GNSS receiver";
  return "its bytes are not frames of the trigger protocol";
}

void PauseRequest::restart() noexcept {
  drop_new();
  open_ = {};
}

std::uint32_t PauseRequest::due(HostStamp now) noexcept {
  const std::uint32_t added = requested_.exchange(0, std::memory_order_acq_rel);
  if (added > 0)
    open_ = {open_.pulses + added, 0, 0, {}};
  else if (open_.pulses == 0 || now < open_.again)
    return 0;
  if (open_.sent == kMaxSent) open_ = {};
  return open_.pulses;
}

void PauseRequest::sent(std::uint8_t sequence, HostStamp now) noexcept {
  open_.sequence = sequence;
  ++open_.sent;
  open_.again = now + kAnswerLimit;
}

void PauseRequest::answered(std::uint8_t sequence) noexcept {
  if (open_.sent > 0 && sequence == open_.sequence) open_ = {};
}

}  // namespace vergence::trigger_board
