#pragma once
#include <memory>
#include <utility>

#include "drivers/serial/byte_line.hpp"
#include "drivers/serial/line_log.hpp"

namespace vergence {

/// A line whose conversation goes into a log.
///
/// Ownership  Owns the line; the log outlives it. All else as ByteLine, but that now() is one
///            thread's: what it said last is the time of what is written next.
class ObservedLine final : public ByteLine {
 public:
  ObservedLine(std::unique_ptr<ByteLine> line, LineLog& log) : line_(std::move(line)), log_(log) {}

  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    const LineRead r = line_->read(out, limit);
    if (r.size > 0)
      log_.note({LineEvent::Kind::read, r.arrival, 0, out.first(r.size)});
    else if (r.status == DeviceStatus::timeout)
      log_.note({LineEvent::Kind::timeout, line_->now(), 0, {}});
    else if (r.status != DeviceStatus::stopped)
      log_.note({LineEvent::Kind::lost, line_->now(), static_cast<std::uint32_t>(r.status), {}});
    return r;
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override {
    log_.note({LineEvent::Kind::written, seen_, 0, bytes});
    return line_->write(bytes, limit);
  }
  DeviceStatus set_baud(std::uint32_t baud) noexcept override {
    log_.note({LineEvent::Kind::baud, line_->now(), baud, {}});
    return line_->set_baud(baud);
  }
  std::uint32_t baud() const noexcept override { return line_->baud(); }
  void discard_input() noexcept override { line_->discard_input(); }
  void wake() noexcept override { line_->wake(); }
  HostStamp now() const noexcept override { return seen_ = line_->now(); }

 private:
  std::unique_ptr<ByteLine> line_;
  LineLog& log_;
  mutable HostStamp seen_{};
};

}  // namespace vergence
