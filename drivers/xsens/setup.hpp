#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/serial/serial_link.hpp"
#include "drivers/xsens/options.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::xsens {

/// Result of a request.
enum class Answer : std::uint8_t {
  ok,
  /// The device responded with an error: Reply::error.
  refused,
  /// No response in time.
  silent,
  /// The link is disconnected.
  disconnected,
  /// Stopped by `stop`.
  stopped,
};

struct Reply {
  Answer answer = Answer::silent;
  /// Code of the error if refused.
  std::uint8_t error = 0;
  /// Size of the payload.
  std::size_t size = 0;
  std::array<std::uint8_t, xbus::kMaxPayload> payload{};
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return {payload.data(), size};
  }
};

/// Requests over an Xbus link, also while data are streaming: other messages are ignored. Not
/// thread-safe. Does not allocate. No call exceeds its limit on the link's clock by more than a
/// read of 50 ms.
class RequestReply {
 public:
  /// While `stop` is true, every request returns `stopped`.
  RequestReply(SerialLink& line, const std::atomic<bool>& stop) noexcept
      : line_(line), stop_(stop) {}

  static constexpr Duration kAnswerTime = Duration::milliseconds(500);

  /// Sends a request and waits for its response, repeating it every 150 ms until the limit.
  void ask(xbus::MessageId id, std::span<const std::uint8_t> payload, Reply* reply,
           Duration limit = kAnswerTime);
  void ask(xbus::MessageId id, Reply* reply) { ask(id, {}, reply); }

  /// Describes received bytes that are not Xbus, for a message; empty if nothing was received.
  [[nodiscard]] std::string received_instead() const;
  [[nodiscard]] std::uint64_t messages_received() const noexcept { return messages_; }
  /// Forgets the received bytes, after a change of the baud rate.
  void reset() noexcept;

 private:
  [[nodiscard]] Answer listen(std::uint8_t requested, HostStamp until, Reply* reply);
  void remember(std::span<const std::uint8_t> bytes) noexcept;

  SerialLink& line_;
  const std::atomic<bool>& stop_;
  xbus::FrameStream stream_;
  std::uint64_t messages_ = 0;
  // The first bytes received.
  std::array<std::uint8_t, 512> received_{};
  std::size_t received_size_ = 0;
};

/// Finds a device on an open link, brings it into its configuration state and changes only
/// differing settings.
///
/// find() takes up to a second per baud rate, the rest a few seconds in total. A device that was
/// found stays in its configuration state on errors. Not thread-safe. Allocates.
class Setup {
 public:
  Setup(SerialLink& line, const Options& options, const std::atomic<bool>& stop)
      : line_(line), options_(options), dialogue_(line, stop) {}

  /// Tries the requested rate, then the usual ones. → ok, not_found, disconnected, stopped
  [[nodiscard]] DeviceStatus find();
  /// Identifies the device; the generation follows from its answer, not its name. → ok,
  /// unsupported, disconnected, stopped
  [[nodiscard]] DeviceStatus identify(Identity* identity);
  /// Sets outputs, rate, synchronisation lines and baud rate. → ok, unsupported, no_bandwidth,
  /// disconnected, stopped, failed
  [[nodiscard]] DeviceStatus set(const Identity& identity, double rate_hz, StreamSettings* stream);
  /// → ok, no_bandwidth, disconnected, stopped, failed
  [[nodiscard]] DeviceStatus measure();

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  [[nodiscard]] DeviceStatus probe(std::uint32_t baud, Duration limit);
  // Each throws Refused if the device refuses; last_error_ has the reason.
  [[nodiscard]] Identity identified();
  void set_legacy(double rate_hz, StreamSettings* stream);
  void set_mark4(double rate_hz, StreamSettings* stream);
  void set_baud(const Identity& identity);
  void set_legacy_lines(double rate_hz, StreamSettings* stream);
  void set_legacy_line(xbus::MessageId id, xbus::LegacySync parameter, std::uint32_t value);
  void set_mark4_lines(StreamSettings* stream);
  void write(xbus::MessageId id, std::span<const std::uint8_t> payload, const char* what);
  void check_load(const xbus::LineBudget& budget, double rate_hz);
  [[noreturn]] void refuse(DeviceStatus status, std::string message);
  /// Throws Refused for the response to the newest request; `refused` is the status if the device
  /// declined.
  [[noreturn]] void fail(const char* what, DeviceStatus refused = DeviceStatus::failed);
  [[nodiscard]] std::uint32_t baud_to_be() const noexcept {
    return options_.baud != 0 ? options_.baud : line_.baud();
  }

  SerialLink& line_;
  Options options_;
  RequestReply dialogue_;
  Reply reply_;
  std::string last_error_;
};

}  // namespace vergence::xsens
