#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/types/time.hpp"

namespace vergence::mock {

/// A serial to USB converter of FTDI's kind, from the bytes of its line to complete transfers of
/// the host's controller.
///
/// It gathers 62 bytes to a packet and sends it with the next USB frame (1 ms); when its latency
/// timer has run since the last packet, what is there then goes as a short packet with the next
/// frame. A transfer is complete with a short packet or with eight full ones.
/// Threads  One caller. Time: the caller's, in the order of timer_at() and frame_at(). Errors:
///          none.
class UsbConverter {
 public:
  /// `clock_ppm` of its timer against the host's USB frames; `first_frame` of those.
  UsbConverter(Duration latency_timer, double clock_ppm, HostStamp now,
               HostStamp first_frame) noexcept;

  /// When its timer runs out; none: it has, and waits for a frame.
  [[nodiscard]] std::optional<HostStamp> timer_at() const noexcept;
  [[nodiscard]] HostStamp frame_at() const noexcept { return next_frame_; }

  void receive(std::uint8_t byte) { chip_.push_back(byte); }
  /// What is there now goes with the next frame, what comes later does not.
  void run_out();
  /// A USB frame: the transfers that are complete by it are appended.
  void frame(HostStamp now, std::vector<std::vector<std::uint8_t>>* transfers);

  /// Nothing is under way in it.
  [[nodiscard]] bool empty() const noexcept {
    return chip_.empty() && short_packet_.empty() && transfer_.empty();
  }
  void discard() noexcept;

 private:
  void packet_went(HostStamp now) noexcept;
  void complete(std::vector<std::vector<std::uint8_t>>* transfers);

  Duration timer_;
  HostStamp next_frame_, last_packet_;
  bool timer_ran_out_ = false;
  std::deque<std::uint8_t> chip_;           // received, in no packet yet
  std::vector<std::uint8_t> short_packet_;  // waits for a frame
  std::vector<std::uint8_t> transfer_;      // gathered by the host's controller
  std::size_t transfer_packets_ = 0;
};

}  // namespace vergence::mock
