#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/math/random.hpp"
#include "core/types/ins_sample.hpp"
#include "drivers/mock/simulators/device_model.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::mock {

/// What the simulated sensor measures: the reading of this number at a time of the drive. Called in
/// order of the numbers, none left out.
using InsSource = std::function<InsSample(std::uint64_t number, Duration time)>;

struct XsensSimulatorOptions {
  xbus::Generation generation = xbus::Generation::mark4;
  std::uint32_t device_id = 0x07701234;
  std::uint32_t baud = 115200;                  // as stored in the device
  double clock_ppm = 20;                        // of its clock against the host's: positive is fast
  HostStamp power_on{};                         // and the drive's time 0
  Duration duration = Duration::seconds(3600);  // of the drive; nothing is sent after it
  Duration processing = Duration::milliseconds(2);          // from a sample to the first byte
  Duration processing_jitter = Duration::microseconds(50);  // above it
  std::uint32_t first_sample_time = 51'703'123;             // SampleTimeFine at power-on, 0.1 ms
  std::uint64_t sample_time_modulus = 864'000'000;          // a day; 2³² on other series
  std::uint16_t first_counter = 65'000;
  std::int64_t unix_ns_at_power_on = 1'577'836'800'000'000'000;
  Duration fix_interval = Duration::milliseconds(250);
  int fix_age = 5;  // samples that a receiver's message is older than the inertial one before it
  double missing_position =
      0;  // of the inertial messages: they come without latitude and longitude (MTi-G-700/710)
  std::vector<HostStamp> dips{};      // the supply dips: the sensor restarts, by itself
  std::vector<HostStamp> silences{};  // the sensor stops sending until it is told to measure again
  // Settings stored in the device; the simulator's own defaults when empty or zero.
  xbus::OutputConfiguration outputs{};
  xbus::MtdataLayout layout{0x0836, 0x001};
  std::uint16_t period = 1152;
  std::uint64_t seed = 1;
};

/// How often a host wrote which setting: a driver that changes only what differs leaves these at
/// zero the second time.
struct XsensWrites {
  int outputs = 0, layout = 0, period = 0, skip = 0, sync_in = 0, sync_out = 0, sync_settings = 0,
      baud = 0;
  int heading = 0;  // message D6 taken as the heading: meant for the other generation
  int refused = 0;  // messages answered with an error
};

/// An XSens INS at byte level: MTi-G (MTData) or MTi-G-700/710 (MTData2).
///
/// Answers as the protocol's description says: configuration and measurement state, wake-up,
/// acknowledgements, errors for what the generation does not know, settings that stay over a reset,
/// a baud rate that holds from the next reset on. Streams what `source` measures on a clock of its
/// own; receiver's messages come late and out of order as captured ones do.
/// Threads  One caller.
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
    return static_cast<std::int64_t>(options_.first_sample_time) * 100'000;
  }
  [[nodiscard]] const XsensWrites& writes() const noexcept { return writes_; }
  [[nodiscard]] double rate_hz() const noexcept;
  /// As the host has set them.
  [[nodiscard]] const xbus::SyncSettings& sync_settings() const noexcept { return sync_; }
  [[nodiscard]] const std::array<std::uint32_t, 4>& legacy_sync_out() const noexcept {
    return legacy_sync_out_;
  }
  [[nodiscard]] const xbus::OutputConfiguration& outputs() const noexcept { return outputs_; }
  [[nodiscard]] const xbus::MtdataLayout& layout() const noexcept { return layout_; }
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
  struct Taken {
    InsSample sample{};
    std::int64_t device_ns = 0;
  };

  static constexpr Duration kAnswerTime = Duration::milliseconds(1);

  [[nodiscard]] static std::uint8_t id_of(xbus::MessageId id) noexcept {
    return static_cast<std::uint8_t>(id);
  }
  [[nodiscard]] std::int64_t device_ns(HostStamp host) const noexcept;
  [[nodiscard]] bool legacy() const noexcept {
    return options_.generation == xbus::Generation::legacy;
  }
  void handle(const xbus::Message& message);
  void handle_setting(const xbus::Message& message);
  void handle_legacy(const xbus::Message& message);
  void handle_mark4(const xbus::Message& message);
  void answer(std::uint8_t id, std::span<const std::uint8_t> payload);
  void answer_u16(const xbus::Message& message, std::uint16_t* setting, int* writes);
  void refuse(std::uint8_t code);
  void send(HostStamp at, std::uint8_t id, std::span<const std::uint8_t> payload);
  void wake(HostStamp at);
  void measure(HostStamp at);
  void plan_sample();
  void take_sample();
  void send_configuration(HostStamp at);
  void send_legacy(const Taken& now, HostStamp at);
  void send_mark4(const Taken& now, HostStamp at);
  void send_fix(HostStamp at);
  void put_stamps(std::int64_t sample_ns, xbus::PacketWriter* packets);
  [[nodiscard]] std::int64_t period_ns() const noexcept;
  [[nodiscard]] bool sync_out_within(std::int64_t from_ns, std::int64_t to_ns) const noexcept;
  [[nodiscard]] xbus::DeviceConfiguration configuration() const noexcept;

  static constexpr std::size_t kRemembered = 4096;

  InsSource source_;
  XsensSimulatorOptions options_;
  Random random_;
  xbus::FrameStream in_;
  HostStamp now_{};
  Mode mode_ = Mode::waking;
  HostStamp waits_for_host_until_{};
  std::optional<HostStamp> reset_at_{};
  std::deque<Outgoing> outgoing_;
  std::uint32_t baud_, stored_baud_;
  HostStamp sample_at_{};       // of the next sample; while measuring
  std::int64_t sample_ns_ = 0;  // the same by the device's clock
  std::int64_t clock_zero_ns_ =
      0;  // of SampleTimeFine and the sample counter: moves at a power cycle
  std::uint64_t samples_ = 0;
  std::uint16_t counter_;
  std::int64_t next_fix_ns_ = 0;
  std::size_t dips_done_ = 0, silences_done_ = 0;
  std::deque<Taken> history_;
  std::deque<std::int64_t> sample_times_;
  // settings
  xbus::OutputConfiguration outputs_;
  xbus::MtdataLayout layout_;
  std::uint16_t period_, skip_ = 0, scenario_ = 6, string_output_ = 0;
  xbus::SyncSettings sync_;
  std::array<std::uint32_t, 4> legacy_sync_in_{}, legacy_sync_out_{0, 0, 0, 29491};  // by parameter
  std::uint8_t fix_age_ = 0;
  XsensWrites writes_;
};

}  // namespace vergence::mock
