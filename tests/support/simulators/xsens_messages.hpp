#pragma once
#include <deque>

#include "core/math/random.hpp"
#include "core/types/ins_sample.hpp"
#include "tests/support/simulators/xsens_settings.hpp"

namespace vergence::test {

/// The data messages of a simulated XSens INS, of both generations: what it sends of a sample.
///
/// Receiver's messages come late and out of order as captured ones do: they are `fix_age` samples
/// old, and of an MTi-G-700/710 they come after the inertial message.
/// Ownership  The settings outlive it.
/// Threads    One caller. Time and units: the device's clock, ns since power-on. Errors: none.
class XsensMessages {
 public:
  struct Sample {
    InsSample sample{};
    std::int64_t device_ns = 0;
  };
  struct Message {
    std::uint8_t id = 0;
    std::vector<std::uint8_t> payload{};
  };

  XsensMessages(const XsensSimulatorOptions& options, const XsensSettings& settings);

  /// It measures, this sample will be the first: the receiver gives a fix with it.
  void begin(std::int64_t device_ns) noexcept { next_fix_ns_ = device_ns; }
  /// Counter and SampleTimeFine begin at zero.
  void power_cycle(std::int64_t device_ns) noexcept;
  /// Samples in order, each once; its messages are appended in theirs. `random` says which of them
  /// come without a position.
  void add(const Sample& sample, Random* random, std::vector<Message>* out);

  /// SampleTimeFine at its origin, ns.
  [[nodiscard]] std::int64_t sample_time_origin_ns() const noexcept {
    return static_cast<std::int64_t>(first_sample_time_) * 100'000;
  }

 private:
  [[nodiscard]] Message legacy(const Sample& now);
  [[nodiscard]] Message mark4(const Sample& now, Random* random);
  [[nodiscard]] Message fix();
  [[nodiscard]] bool fix_requested() const noexcept;
  void put_stamps(std::int64_t sample_ns, xbus::PacketWriter* packets);

  XsensSimulatorOptions options_;
  const XsensSettings& settings_;
  std::uint32_t first_sample_time_;
  /// Zero of SampleTimeFine and of the sample counter: moves at a power cycle.
  std::int64_t clock_zero_ns_ = 0;
  std::uint16_t counter_;
  std::int64_t next_fix_ns_ = 0;
  std::uint8_t fix_age_ = 0;
  std::deque<Sample> history_;
};

}  // namespace vergence::test
