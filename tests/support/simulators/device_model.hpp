#pragma once
#include <optional>
#include <span>
#include <vector>

#include "core/types/time.hpp"

namespace vergence::test {

/// A device at the far end of a simulated serial line: bytes in, bytes out, at times of the host's
/// clock (which the device does not know; its own clock is the model's affair).
///
/// Threads  One caller. Time: calls come in the order of their times.
class DeviceModel {
 public:
  virtual ~DeviceModel() = default;
  /// Bytes whose last bit came in at `at`.
  virtual void receive(std::span<const std::uint8_t> bytes, HostStamp at) = 0;
  /// When it has something to send next; nothing: not before it is asked.
  [[nodiscard]] virtual std::optional<HostStamp> next() const = 0;
  /// Bytes for its transmitter at that time.
  virtual void produce(HostStamp at, std::vector<std::uint8_t>* out) = 0;
  /// Rate of its transmitter and receiver: another at the host means garbage both ways.
  [[nodiscard]] virtual std::uint32_t baud() const = 0;
  /// Its supply was cut and came back.
  virtual void power_cycle(HostStamp at) = 0;
  /// Nothing will come any more.
  [[nodiscard]] virtual bool ended() const { return false; }
};

}  // namespace vergence::test
