#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "firmware_iface/xbus/frame.hpp"

/// Payloads of requests and settings; frame.hpp puts them into frames.
namespace vergence::xbus {

/// Which of the two protocols a device speaks: the same message id means different things.
enum class Generation : std::uint8_t { legacy, mark4 };  // MTi-G (MTData); MTi-G-700/710 (MTData2)

/// Product by the range of a device id. Nullopt: neither; the device's answer to
/// `output_configuration` decides.
[[nodiscard]] std::optional<Generation> generation_of_device_id(std::uint32_t id) noexcept;

// ---- baud rate ----

/// Code of message 18; nothing: the device cannot. 921600 has the old code on the MTi-G, which
/// every firmware knows.
[[nodiscard]] std::optional<std::uint8_t> baud_code(std::uint32_t baud,
                                                    Generation generation) noexcept;
[[nodiscard]] std::optional<std::uint32_t> baud_of_code(std::uint8_t code) noexcept;

/// Rates at which a device may be found, the likely ones first.
inline constexpr std::array<std::uint32_t, 8> kBaudScan{115200, 460800, 921600, 230400,
                                                        57600,  38400,  19200,  9600};

// ---- the MTi-G's rate ----

inline constexpr std::uint32_t kPeriodClock = 115200;  // Hz
/// Period of message 04; nothing: the clock has no such rate, or correction by the receiver's pulse
/// excludes it.
[[nodiscard]] std::optional<std::uint16_t> period_of_rate(double rate_hz) noexcept;

// ---- configuration message (0D) ----

inline constexpr std::size_t kConfigurationSize = 118;  // bytes
/// Configuration that an MTi-G sends before it measures: enough to read a log without knowing how
/// the device was set.
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
  std::array<std::uint8_t, 3> firmware{};  // MTi-G: major, minor, revision
};
/// False: not a configuration of one device; *out untouched.
[[nodiscard]] bool read_configuration(std::span<const std::uint8_t> payload,
                                      DeviceConfiguration* out) noexcept;
/// Precondition: room for kConfigurationSize.
void write_configuration(const DeviceConfiguration& configuration,
                         std::span<std::uint8_t> out) noexcept;

// ---- output configuration (C0) ----

/// One packet of MTData2 and how often it comes.
struct OutputEntry {
  std::uint16_t id = 0;       // wire_id()
  std::uint16_t rate_hz = 0;  // kEveryMessage: with each
  constexpr bool operator==(const OutputEntry&) const noexcept = default;
};
inline constexpr std::uint16_t kEveryMessage = 0xFFFF;
inline constexpr std::size_t kMaxOutputs = 32;

/// A list as it stands in a message, in place.
struct OutputConfiguration {
  std::array<OutputEntry, kMaxOutputs> entries{};
  std::size_t count = 0;

  [[nodiscard]] std::span<const OutputEntry> items() const noexcept {
    return {entries.data(), count};
  }
  /// False: full.
  [[nodiscard]] bool add(OutputEntry entry) noexcept {
    if (count == entries.size()) return false;
    entries[count++] = entry;
    return true;
  }
  bool operator==(const OutputConfiguration& o) const noexcept;
};
/// False: not whole entries, or too many; *out untouched.
[[nodiscard]] bool read_output_configuration(std::span<const std::uint8_t> payload,
                                             OutputConfiguration* out) noexcept;
/// Bytes written; 0: no room.
[[nodiscard]] std::size_t write_output_configuration(const OutputConfiguration& configuration,
                                                     std::span<std::uint8_t> out) noexcept;

// ---- synchronisation lines ----

/// Parameters of the MTi-G's SyncIn (D6) and SyncOut (D8): one a message.
enum class LegacySync : std::uint8_t {
  mode = 0,
  skip = 1,
  offset = 2,
  width = 3
};  // mode and skip 16 bits, offset and width 32
inline constexpr std::uint16_t kLegacySyncOutOff = 0x00;
inline constexpr std::uint16_t kLegacySyncOutToggle = 0x01;
inline constexpr std::uint16_t kLegacySyncOutPulse = 0x02;
inline constexpr std::uint16_t kLegacySyncOutPositive = 0x10;
inline constexpr double kLegacySyncClock = 29.4912e6;  // Hz, of offset and width
/// Bytes written (3 or 5); 0: no room.
[[nodiscard]] std::size_t write_legacy_sync(LegacySync parameter, std::uint32_t value,
                                            std::span<std::uint8_t> out) noexcept;
/// False: neither 3 nor 5 bytes as the parameter wants them.
[[nodiscard]] bool read_legacy_sync(std::span<const std::uint8_t> payload, LegacySync* parameter,
                                    std::uint32_t* value) noexcept;

/// One entry of an MTi-G-700/710's list (2C). The list replaces the old one: read, edit, write.
struct SyncEntry {
  std::uint8_t function = 0, line = 0, polarity = 0, once = 0;
  std::uint16_t skip_first = 0, skip = 0;
  std::uint16_t width = 0;  // 100 µs
  std::int16_t delay = 0;   // 100 µs
  constexpr bool operator==(const SyncEntry&) const noexcept = default;
};
inline constexpr std::uint8_t kSyncIntervalTransition = 4;  // SyncOut
inline constexpr std::uint8_t kSyncLineOut = 4;
inline constexpr std::uint8_t kSyncPositive = 1;
inline constexpr double kSyncOutBase = 400;  // Hz: SyncOut counts this, whatever the data rate
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

/// Pulses skipped between two of SyncOut for this rate, nearest: base / (skip + 1). *actual_hz:
/// what it then makes.
[[nodiscard]] std::uint16_t sync_out_skip(double base_hz, double rate_hz,
                                          double* actual_hz) noexcept;

// ---- errors ----

/// Describes an error message's code.
[[nodiscard]] std::string_view error_text(std::uint8_t code) noexcept;
inline constexpr std::uint8_t kErrorMessageUnknown =
    0x04;  // what a device of the other generation answers
inline constexpr std::uint8_t kErrorParameter = 0x21;
inline constexpr std::uint8_t kErrorPowerDip = 0x2D;

}  // namespace vergence::xbus
