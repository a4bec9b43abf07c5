#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "firmware_iface/xbus/frame.hpp"

/// Payloads of requests and settings; frame.hpp frames them.
namespace vergence::xbus {

/// Protocol of a device: MTData of the MTi-G, or MTData2 of the MTi-G-700/710. Equal message ids
/// have different meanings.
enum class Generation : std::uint8_t { legacy, mark4 };

// Baud rate.

/// Code of message 18; empty if the device does not support the rate. 921600 uses the MTi-G's old
/// code, which every firmware supports.
[[nodiscard]] std::optional<std::uint8_t> baud_code(std::uint32_t baud,
                                                    Generation generation) noexcept;
[[nodiscard]] std::optional<std::uint32_t> baud_of_code(std::uint8_t code) noexcept;

/// Rates at which a device may be found, likely ones first.
inline constexpr std::array<std::uint32_t, 8> kBaudScan{115200, 460800, 921600, 230400,
                                                        57600,  38400,  19200,  9600};

// Rate of the MTi-G.

/// In Hz.
inline constexpr std::uint32_t kPeriodClock = 115200;
/// Period of message 04; empty if the clock has no such rate, or correction by the receiver's pulse
/// excludes it.
[[nodiscard]] std::optional<std::uint16_t> period_of_rate(double rate_hz) noexcept;

// Configuration message (0D).

/// In bytes.
inline constexpr std::size_t kConfigurationSize = 118;
/// Configuration that an MTi-G sends before it measures, sufficient to decode a log without knowing
/// its settings.
struct DeviceConfiguration {
  std::uint32_t master_id = 0;
  std::uint16_t period = 0, output_skip = 0;
  std::uint16_t sync_in_mode = 0, sync_in_skip = 0;
  std::uint32_t sync_in_offset = 0;
  std::uint16_t devices = 0;
  std::uint32_t device_id = 0;
  std::uint16_t data_length = 0;
  std::uint16_t output_mode = 0;
  std::uint32_t output_settings = 0;
  std::uint16_t scenario = 0;
  /// Major, minor and revision of an MTi-G.
  std::array<std::uint8_t, 3> firmware{};
};
/// Returns false, with *out unchanged, if it is not a configuration of one device.
[[nodiscard]] bool read_configuration(std::span<const std::uint8_t> payload,
                                      DeviceConfiguration* out) noexcept;
/// Precondition: room for kConfigurationSize.
void write_configuration(const DeviceConfiguration& configuration,
                         std::span<std::uint8_t> out) noexcept;

// Output configuration (C0).

/// Packet of MTData2 and its rate.
struct OutputEntry {
  /// Value of wire_id().
  std::uint16_t id = 0;
  /// kEveryMessage sends it with each message.
  std::uint16_t rate_hz = 0;
  constexpr bool operator==(const OutputEntry&) const noexcept = default;
};
inline constexpr std::uint16_t kEveryMessage = 0xFFFF;
inline constexpr std::size_t kMaxOutputs = 32;

/// Output list of a message.
struct OutputConfiguration {
  std::array<OutputEntry, kMaxOutputs> entries{};
  std::size_t count = 0;

  [[nodiscard]] std::span<const OutputEntry> items() const noexcept {
    return {entries.data(), count};
  }
  /// Returns false if the list is full.
  [[nodiscard]] bool add(OutputEntry entry) noexcept {
    if (count == entries.size()) return false;
    entries[count++] = entry;
    return true;
  }
  bool operator==(const OutputConfiguration& o) const noexcept;
};
/// Returns false, with *out unchanged, for incomplete or too many entries.
[[nodiscard]] bool read_output_configuration(std::span<const std::uint8_t> payload,
                                             OutputConfiguration* out) noexcept;
/// Returns the number of bytes written; 0 if there is no room.
[[nodiscard]] std::size_t write_output_configuration(const OutputConfiguration& configuration,
                                                     std::span<std::uint8_t> out) noexcept;

// Synchronisation lines.

/// Parameters of the MTi-G's SyncIn (D6) and SyncOut (D8), one per message. Mode and skip have 16
/// bits, offset and width 32.
enum class LegacySync : std::uint8_t { mode = 0, skip = 1, offset = 2, width = 3 };
inline constexpr std::uint16_t kLegacySyncOutOff = 0x00;
inline constexpr std::uint16_t kLegacySyncOutToggle = 0x01;
inline constexpr std::uint16_t kLegacySyncOutPulse = 0x02;
inline constexpr std::uint16_t kLegacySyncOutPositive = 0x10;
/// Clock of offset and width in Hz.
inline constexpr double kLegacySyncClock = 29.4912e6;
/// Returns the number of bytes written (3 or 5); 0 if there is no room.
[[nodiscard]] std::size_t write_legacy_sync(LegacySync parameter, std::uint32_t value,
                                            std::span<std::uint8_t> out) noexcept;
/// Returns false if the size is not that of the parameter (3 or 5 bytes).
[[nodiscard]] bool read_legacy_sync(std::span<const std::uint8_t> payload, LegacySync* parameter,
                                    std::uint32_t* value) noexcept;

/// Entry of an MTi-G-700/710's list (2C). Writing replaces the whole list.
struct SyncEntry {
  std::uint8_t function = 0, line = 0, polarity = 0, once = 0;
  std::uint16_t skip_first = 0, skip = 0;
  /// In units of 100 µs.
  std::uint16_t width = 0;
  /// In units of 100 µs.
  std::int16_t delay = 0;
  constexpr bool operator==(const SyncEntry&) const noexcept = default;
};
/// Function of SyncOut.
inline constexpr std::uint8_t kSyncIntervalTransition = 4;
inline constexpr std::uint8_t kSyncLineOut = 4;
inline constexpr std::uint8_t kSyncPositive = 1;
/// In Hz; SyncOut divides this rate, whatever the data rate.
inline constexpr double kSyncOutBase = 400;
inline constexpr std::size_t kSyncEntrySize = 12;
inline constexpr std::size_t kMaxSyncEntries = 16;

struct SyncSettings {
  std::array<SyncEntry, kMaxSyncEntries> entries{};
  std::size_t count = 0;

  [[nodiscard]] std::span<const SyncEntry> items() const noexcept {
    return {entries.data(), count};
  }
  bool operator==(const SyncSettings& o) const noexcept;
};
[[nodiscard]] bool read_sync_settings(std::span<const std::uint8_t> payload,
                                      SyncSettings* out) noexcept;
[[nodiscard]] std::size_t write_sync_settings(const SyncSettings& settings,
                                              std::span<std::uint8_t> out) noexcept;

/// Number of skipped pulses between two of SyncOut for the nearest rate base / (skip + 1).
/// *actual_hz receives that rate.
[[nodiscard]] std::uint16_t sync_out_skip(double base_hz, double rate_hz,
                                          double* actual_hz) noexcept;

// Errors.

/// Describes the code of an error message.
[[nodiscard]] std::string_view error_text(std::uint8_t code) noexcept;
/// Answer of a device of the other generation.
inline constexpr std::uint8_t kErrorMessageUnknown = 0x04;
inline constexpr std::uint8_t kErrorParameter = 0x21;
inline constexpr std::uint8_t kErrorPowerDip = 0x2D;

}  // namespace vergence::xbus
