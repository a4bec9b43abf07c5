#pragma once
#include <functional>

#include "tests/support/simulators/device_model.hpp"
#include "tests/support/simulators/xsens_messages.hpp"

namespace vergence::test {

/// Measurement of the simulated sensor: the reading of this number at a time of the drive. Called
/// in order of the numbers, none left out.
using InsSource = std::function<InsSample(std::uint64_t number, Duration time)>;

/// An XSens INS at byte level: MTi-G (MTData) or MTi-G-700/710 (MTData2).
///
/// Answers as the protocol's description says: configuration and measurement state, wake-up,
/// acknowledgements, settings (XsensSettings), a baud rate that holds from the next reset on.
/// Streams what `source` measures on a clock of its own (XsensMessages). Threads  One caller.
class XsensSimulator final : public DeviceModel {
 public:
  XsensSimulator(InsSource source, const XsensSimulatorOptions& options);

  void receive(std::span<const std::uint8_t> bytes, HostStamp at) override;
  [[nodiscard]] std::optional<HostStamp> next() const override;
  void produce(HostStamp at, std::vector<std::uint8_t>* out) override;
  [[nodiscard]] std::uint32_t baud() const override { return baud_; }
  void power_cycle(HostStamp at) override;
  [[nodiscard]] bool ended() const override;

  /// The host's time at which the device's clock showed so many nanoseconds since power-on.
  [[nodiscard]] HostStamp host_time(std::int64_t device_ns) const noexcept;
  /// Device time of SampleTimeFine's origin: a driver's unwrapped stamp less this is nanoseconds
  /// since power-on.
  [[nodiscard]] std::int64_t sample_time_origin_ns() const noexcept {
    return messages_.sample_time_origin_ns();
  }
  [[nodiscard]] const XsensWrites& writes() const noexcept { return settings_.writes(); }
  [[nodiscard]] bool measuring() const noexcept { return mode_ == Mode::measuring; }
  /// As the host has set it.
  [[nodiscard]] const XsensSettings& settings() const noexcept { return settings_; }
  /// Samples taken so far, by their device time since power-on, newest last; at most kRemembered.
  [[nodiscard]] const std::deque<std::int64_t>& sample_times_ns() const noexcept {
    return sample_times_;
  }

 private:
  enum class Mode : std::uint8_t { waking, configuring, measuring, mute };
  struct Outgoing {
    HostStamp at{};
    std::vector<std::uint8_t> bytes;
  };
  static constexpr Duration kAnswerTime = Duration::milliseconds(1);

  [[nodiscard]] static std::uint8_t id_of(xbus::MessageId id) noexcept {
    return static_cast<std::uint8_t>(id);
  }
  [[nodiscard]] std::int64_t device_ns(HostStamp host) const noexcept;
  void handle(const xbus::Message& message);
  void go_to_measurement(const xbus::Message& message);
  void answer(std::uint8_t id, std::span<const std::uint8_t> payload);
  void send(HostStamp at, std::uint8_t id, std::span<const std::uint8_t> payload);
  void wake(HostStamp at);
  void measure(HostStamp at);
  void plan_sample();
  void take_sample();
  void send_configuration(HostStamp at);

  static constexpr std::size_t kRemembered = 4096;

  InsSource source_;
  XsensSimulatorOptions options_;
  Random random_;
  xbus::FrameStream in_;
  HostStamp now_{};
  Mode mode_ = Mode::waking;
  /// It hears nothing before.
  HostStamp starts_at_{};
  HostStamp waits_for_host_until_{};
  std::optional<HostStamp> reset_at_{};
  std::deque<Outgoing> outgoing_;
  std::uint32_t baud_;
  /// Time of the next sample while measuring, then the same by the device's clock.
  HostStamp sample_at_{};
  std::int64_t sample_ns_ = 0;
  std::uint64_t samples_ = 0;
  std::size_t silences_done_ = 0;
  std::deque<std::int64_t> sample_times_;
  XsensSettings settings_;
  XsensMessages messages_;
};

}  // namespace vergence::test
