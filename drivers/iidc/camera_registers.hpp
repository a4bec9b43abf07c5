#pragma once
#include <cstdint>
#include <string>

#include "drivers/iidc/bus.hpp"
#include "firmware_iface/iidc/iidc.hpp"

namespace vergence::iidc {

/// The range of a feature's absolute value.
struct AbsoluteRange {
  bool present = false;
  double least = 0, most = 0;
};

/// The registers of a camera by their meaning. The first access that fails sticks: what follows
/// does nothing and reads 0, and pop_status() tells at the end. So a sequence of registers is
/// written as one, and checked once.
///
/// Threads  One caller at a time. Time: no wait is longer than `patience` beside the port's own
///          time-outs.
class CameraRegisters {
 public:
  CameraRegisters(RegisterPort* port, std::uint64_t command_base, Duration patience) noexcept
      : port_(port), base_(command_base), patience_(patience) {}

  // From the command base.
  [[nodiscard]] std::uint32_t get(std::uint32_t offset) noexcept { return get_at(base_ + offset); }
  void set(std::uint32_t offset, std::uint32_t value) noexcept { set_at(base_ + offset, value); }
  // By address.
  [[nodiscard]] std::uint32_t get_at(std::uint64_t address) noexcept;
  void set_at(std::uint64_t address, std::uint32_t value) noexcept;
  /// As get(), but 0 where the camera refuses the address: for registers that not all have.
  [[nodiscard]] std::uint32_t get_optional(std::uint32_t offset) noexcept;
  /// Address of a table whose quadlet offset stands in a register; 0: the camera has no such table.
  [[nodiscard]] std::uint64_t table(std::uint32_t offset) noexcept;
  /// Reads until the bits are clear. Too long: the status becomes timeout.
  void await_clear(std::uint64_t address, std::uint32_t bits) noexcept;

  [[nodiscard]] bool has_mode(unsigned format, unsigned mode) noexcept;
  [[nodiscard]] FeatureInquiry inquiry(Feature f) noexcept {
    return FeatureInquiry::of(get(reg::feature_inquiry(f)));
  }
  [[nodiscard]] AbsoluteRange absolute_range(Feature f) noexcept;
  /// Switches the feature to its absolute value, not automatic, and sets it. → the value as the
  /// camera rounded it.
  [[nodiscard]] double set_absolute(Feature f, double value) noexcept;
  /// Not automatic, and off where it can be.
  void switch_off(Feature f) noexcept;

  void transmit(bool on) noexcept { set(reg::kTransmit, on ? bit(31) : 0); }
  /// Fires when the camera is ready for it.
  void software_trigger() noexcept;

  /// Applies a Format 7 mode's values by the handshake of version 1.30; nothing on older cameras.
  /// False: the camera refuses them (`error` is one of reg::format7::kError…), or a register
  /// failed.
  [[nodiscard]] bool apply_format7(std::uint64_t csr, std::uint32_t error) noexcept;

  /// The first failure since the last call, ok otherwise; begins again.
  [[nodiscard]] DeviceStatus pop_status() noexcept;
  [[nodiscard]] DeviceStatus status() const noexcept { return status_; }
  /// About the failure: which register, what it did.
  [[nodiscard]] std::string last_error() const;

 private:
  void fail(DeviceStatus status, std::uint64_t address, bool writing) noexcept;

  RegisterPort* port_;
  std::uint64_t base_;
  Duration patience_;
  DeviceStatus status_ = DeviceStatus::ok;
  DeviceStatus last_failure_ = DeviceStatus::ok;  // the last failure, for last_error()
  std::uint64_t failed_at_ = 0;
  bool failed_writing_ = false;
};

/// Reads the configuration ROM quadlet by quadlet until it ends (longer reads over the end fail),
/// and parses it.
[[nodiscard]] DeviceStatus read_rom(RegisterPort* port, ConfigRom* rom, std::string* message);

}  // namespace vergence::iidc
