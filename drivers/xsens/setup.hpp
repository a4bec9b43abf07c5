#pragma once
#include <cstdint>
#include <string>

#include "drivers/xsens/options.hpp"
#include "drivers/xsens/request_reply.hpp"

namespace vergence::xsens {

/// Finds a device on an open line, brings it into its configuration state and sets it, changing
/// only what differs.
///
/// Threads  One caller. Memory: ordinary. Time: find() up to a second for each baud rate, the rest
///          at most a few seconds in all.
/// Errors   Status and last_error(); a device that was found stays in its configuration state.
class Setup {
 public:
  Setup(ByteLine& line, const Options& options, const std::atomic<bool>& stop)
      : line_(line), options_(options), dialogue_(line, stop) {}

  /// Tries the rate asked for, then the usual ones. → ok, not_found, gone, stopped
  [[nodiscard]] DeviceStatus find();
  /// Who it is; the generation is what it answers, not what its name says. → ok, unsupported, gone,
  /// stopped
  [[nodiscard]] DeviceStatus identify(Identity* identity);
  /// Output, rate, lines and baud rate. → ok, unsupported, no_bandwidth, gone, stopped, failed
  [[nodiscard]] DeviceStatus set(const Identity& identity, double rate_hz, StreamSettings* stream);
  /// → ok, no_bandwidth, gone, stopped, failed
  [[nodiscard]] DeviceStatus measure();

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  [[nodiscard]] DeviceStatus probe(std::uint32_t baud, Duration limit);
  [[nodiscard]] DeviceStatus set_legacy(double rate_hz, StreamSettings* stream);
  [[nodiscard]] DeviceStatus set_mark4(double rate_hz, StreamSettings* stream);
  [[nodiscard]] DeviceStatus set_baud(const Identity& identity);
  [[nodiscard]] DeviceStatus set_legacy_lines(double rate_hz, StreamSettings* stream);
  [[nodiscard]] DeviceStatus set_legacy_line(xbus::MessageId id, xbus::LegacySync parameter,
                                             std::uint32_t value);
  [[nodiscard]] DeviceStatus set_mark4_lines(StreamSettings* stream);
  [[nodiscard]] DeviceStatus write(xbus::MessageId id, std::span<const std::uint8_t> payload,
                                   const char* what);
  [[nodiscard]] DeviceStatus failed(const char* what);
  [[nodiscard]] DeviceStatus refuse_load(const xbus::LineBudget& budget, double rate_hz,
                                         std::uint32_t baud);
  [[nodiscard]] std::uint32_t baud_to_be() const noexcept {
    return options_.baud != 0 ? options_.baud : line_.baud();
  }

  ByteLine& line_;
  Options options_;
  RequestReply dialogue_;
  Reply reply_;
  std::string last_error_;
};

}  // namespace vergence::xsens
