#pragma once
#include <cstdint>
#include <string>

#include "drivers/iidc/bus.hpp"
#include "firmware_iface/iidc/iidc.hpp"

namespace vergence::iidc {

/// Range of a feature's absolute value.
struct AbsoluteRange {
  bool present = false;
  double least = 0, most = 0;
};

/// Typed access to the registers of a camera. After the first failed access all others do nothing
/// and read 0, so a sequence of accesses is checked once, with pop_status().
///
/// One caller at a time. No wait exceeds `patience` plus the port's own timeouts.
class CameraRegisters {
 public:
  CameraRegisters(RegisterPort* port, std::uint64_t command_base, Duration patience) noexcept
      : port_(port), base_(command_base), patience_(patience) {}

  // Access by offset from the command base.
  [[nodiscard]] std::uint32_t get(std::uint32_t offset) noexcept { return get_at(base_ + offset); }
  void set(std::uint32_t offset, std::uint32_t value) noexcept { set_at(base_ + offset, value); }
  // Access by address.
  [[nodiscard]] std::uint32_t get_at(std::uint64_t address) noexcept;
  void set_at(std::uint64_t address, std::uint32_t value) noexcept;
  /// Same as get(), but returns 0 if the camera refuses the address; for registers that not all
  /// cameras have.
  [[nodiscard]] std::uint32_t get_optional(std::uint32_t offset) noexcept;
  /// Address of a table whose quadlet offset is in a register; 0 if the camera has no such table.
  [[nodiscard]] std::uint64_t table(std::uint32_t offset) noexcept;
  /// Reads until the bits are clear. The status becomes timeout if that takes too long.
  void await_clear(std::uint64_t address, std::uint32_t bits) noexcept;

  [[nodiscard]] bool has_mode(unsigned format, unsigned mode) noexcept;
  [[nodiscard]] FeatureInquiry inquiry(Feature f) noexcept {
    return FeatureInquiry::of(get(reg::feature_inquiry(f)));
  }
  [[nodiscard]] AbsoluteRange absolute_range(Feature f) noexcept;
  /// Selects the feature's absolute, manual control and sets it. Returns the value rounded by the
  /// camera.
  [[nodiscard]] double set_absolute(Feature f, double value) noexcept;
  /// Selects manual control, and turns the feature off if possible.
  void switch_off(Feature f) noexcept;

  void transmit(bool on) noexcept { set(reg::kTransmit, on ? bit(31) : 0); }
  /// Triggers once the camera is ready.
  void software_trigger() noexcept;

  /// Applies a Format 7 mode's values by the handshake of version 1.30; does nothing on older
  /// cameras. Returns false if the camera refuses them (`error` is one of reg::format7::kError…) or
  /// a register failed.
  [[nodiscard]] bool apply_format7(std::uint64_t csr, std::uint32_t error) noexcept;

  /// Returns the first failure since the last call, or ok, and clears it.
  [[nodiscard]] DeviceStatus pop_status() noexcept;
  [[nodiscard]] DeviceStatus status() const noexcept { return status_; }
  /// Names the register of the failure and its effect.
  [[nodiscard]] std::string last_error() const;

 private:
  void fail(DeviceStatus status, std::uint64_t address, bool writing) noexcept;

  RegisterPort* port_;
  std::uint64_t base_;
  Duration patience_;
  DeviceStatus status_ = DeviceStatus::ok;
  // Last failure, kept for last_error().
  DeviceStatus last_failure_ = DeviceStatus::ok;
  std::uint64_t failed_at_ = 0;
  bool failed_writing_ = false;
};

/// Reads the configuration ROM quadlet by quadlet to its end (longer reads beyond the end fail) and
/// parses it.
[[nodiscard]] DeviceStatus read_rom(RegisterPort* port, ConfigRom* rom, std::string* message);

}  // namespace vergence::iidc
