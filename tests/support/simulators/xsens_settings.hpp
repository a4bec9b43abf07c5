#pragma once
#include <array>

#include "tests/support/simulators/xsens_simulator_options.hpp"

namespace vergence::test {

/// Number of writes by setting: a driver that changes only what differs leaves these at
/// zero the second time.
struct XsensWrites {
  int outputs = 0, layout = 0, period = 0, skip = 0, sync_out = 0, sync_settings = 0, baud = 0;
  /// Message D6 taken as the heading: meant for the other generation.
  int heading = 0;
  /// Messages answered with an error.
  int refused = 0;
};

/// Settings of a simulated XSens INS and its answers to requests: the
/// requests of its configuration state.
///
/// Settings stay over a reset, as those of the device do; the baud rate holds from the next one on.
/// Requests unknown to the generation are refused.
/// Threads  One caller. Errors: none; a refusal is a reply.
class XsensSettings {
 public:
  struct Reply {
    std::uint8_t id = 0;
    std::vector<std::uint8_t> payload{};
  };

  explicit XsensSettings(const XsensSimulatorOptions& options);

  /// Any request but those that change the device's state.
  [[nodiscard]] Reply handle(const xbus::Message& message);
  /// The error message of this code; counted.
  [[nodiscard]] Reply refuse(std::uint8_t code);

  [[nodiscard]] bool legacy() const noexcept { return generation_ == xbus::Generation::legacy; }
  [[nodiscard]] const xbus::OutputConfiguration& outputs() const noexcept { return outputs_; }
  [[nodiscard]] const xbus::MtdataLayout& layout() const noexcept { return layout_; }
  [[nodiscard]] const xbus::SyncSettings& sync_settings() const noexcept { return sync_; }
  [[nodiscard]] const std::array<std::uint32_t, 4>& legacy_sync_out() const noexcept {
    return legacy_sync_out_;
  }
  /// From the next reset on.
  [[nodiscard]] std::uint32_t stored_baud() const noexcept { return stored_baud_; }
  [[nodiscard]] const XsensWrites& writes() const noexcept { return writes_; }

  /// Between two samples, by the device's clock.
  [[nodiscard]] std::int64_t period_ns() const noexcept;
  [[nodiscard]] double rate_hz() const noexcept { return 1e9 / static_cast<double>(period_ns()); }
  /// Load of the link while measuring: 1 is full.
  [[nodiscard]] double line_load(std::uint32_t baud) const noexcept;
  /// A pulse of SyncOut went out after `from_ns` and up to `to_ns`, by the device's clock.
  [[nodiscard]] bool sync_out_within(std::int64_t from_ns, std::int64_t to_ns) const noexcept;
  [[nodiscard]] xbus::DeviceConfiguration configuration() const noexcept;

 private:
  [[nodiscard]] Reply handle_legacy(const xbus::Message& message);
  [[nodiscard]] Reply handle_mark4(const xbus::Message& message);
  [[nodiscard]] Reply answer_u16(const xbus::Message& message, std::uint16_t* setting, int* writes);

  xbus::Generation generation_;
  std::uint32_t device_id_;
  std::uint32_t stored_baud_;
  xbus::OutputConfiguration outputs_;
  xbus::MtdataLayout layout_;
  std::uint16_t period_, skip_ = 0, scenario_ = 6, string_output_ = 0;
  xbus::SyncSettings sync_;
  /// By parameter.
  std::array<std::uint32_t, 4> legacy_sync_out_{0, 0, 0, 29491};
  XsensWrites writes_;
};

}  // namespace vergence::test
