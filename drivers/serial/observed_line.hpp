#pragma once
#include <atomic>
#include <memory>
#include <utility>

#include "drivers/serial/byte_line.hpp"

namespace vergence {

/// A line whose incoming bytes an observer sees, when there is one.
///
/// Ownership  Owns the line; the pointer to the observer outlives it. All else as ByteLine.
class ObservedLine final : public ByteLine {
 public:
  ObservedLine(std::unique_ptr<ByteLine> line, const std::atomic<ByteObserver*>& observer)
      : line_(std::move(line)), observer_(observer) {}

  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    const LineRead r = line_->read(out, limit);
    ByteObserver* observer = observer_.load(std::memory_order_acquire);
    if (observer != nullptr && r.size > 0) observer->on_bytes(out.first(r.size), r.arrival);
    return r;
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override {
    return line_->write(bytes, limit);
  }
  DeviceStatus set_baud(std::uint32_t baud) noexcept override { return line_->set_baud(baud); }
  std::uint32_t baud() const noexcept override { return line_->baud(); }
  void discard_input() noexcept override { line_->discard_input(); }
  void wake() noexcept override { line_->wake(); }
  HostStamp now() const noexcept override { return line_->now(); }

 private:
  std::unique_ptr<ByteLine> line_;
  const std::atomic<ByteObserver*>& observer_;
};

}  // namespace vergence
