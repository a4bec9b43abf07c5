#include "drivers/mock/simulators/usb_converter.hpp"

#include <cmath>
#include <utility>

namespace vergence::mock {
namespace {

constexpr Duration kUsbFrame = Duration::milliseconds(1);
constexpr std::size_t kPacketBytes = 62;
constexpr std::size_t kTransferPackets = 8;

}  // namespace

UsbConverter::UsbConverter(Duration latency_timer, double clock_ppm, HostStamp now,
                           HostStamp first_frame) noexcept
    : timer_(Duration::nanoseconds(
          std::llround(static_cast<double>(latency_timer.ns()) * (1 + 1e-6 * clock_ppm)))),
      next_frame_(first_frame),
      last_packet_(now) {}

std::optional<HostStamp> UsbConverter::timer_at() const noexcept {
  if (timer_ran_out_) return std::nullopt;
  return last_packet_ + timer_;
}

void UsbConverter::run_out() {
  timer_ran_out_ = true;
  if (chip_.size() >= kPacketBytes) return;
  short_packet_.assign(chip_.begin(), chip_.end());
  chip_.clear();
}

void UsbConverter::frame(HostStamp now, std::vector<std::vector<std::uint8_t>>* transfers) {
  next_frame_ = next_frame_ + kUsbFrame;
  if (timer_ran_out_ && (!short_packet_.empty() || chip_.size() < kPacketBytes)) {
    transfer_.insert(transfer_.end(), short_packet_.begin(), short_packet_.end());
    short_packet_.clear();
    packet_went(now);
    complete(transfers);
  }
  while (chip_.size() >= kPacketBytes) {
    transfer_.insert(transfer_.end(), chip_.begin(), chip_.begin() + kPacketBytes);
    chip_.erase(chip_.begin(), chip_.begin() + kPacketBytes);
    packet_went(now);
    if (++transfer_packets_ == kTransferPackets) complete(transfers);
  }
}

void UsbConverter::packet_went(HostStamp now) noexcept {
  last_packet_ = now;
  timer_ran_out_ = false;
}

void UsbConverter::complete(std::vector<std::vector<std::uint8_t>>* transfers) {
  transfer_packets_ = 0;
  if (!transfer_.empty()) transfers->push_back(std::exchange(transfer_, {}));
}

void UsbConverter::discard() noexcept {
  chip_.clear();
  short_packet_.clear();
  transfer_.clear();
  transfer_packets_ = 0;
}

}  // namespace vergence::mock
