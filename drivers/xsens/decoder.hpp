#pragma once
#include <cstdint>
#include <span>

#include "drivers/ins.hpp"
#include "drivers/xsens/arrival_timing.hpp"
#include "drivers/xsens/convert.hpp"
#include "drivers/xsens/options.hpp"
#include "drivers/xsens/sample_clock.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::xsens {

/// Counters of a stream; all only grow.
struct DecoderCounters {
  std::uint64_t readings = 0;
  std::uint64_t fixes = 0;  // receiver's messages
  std::uint64_t lost =
      0;  // messages (MTi-G-700/710) or samples (MTi-G) missing in the device's count
  std::uint64_t malformed = 0;   // whole frames that made no sense
  std::uint64_t backward = 0;    // samples not newer than the one before
  std::uint64_t incomplete = 0;  // samples without attitude and position, or without a position
                                 // though there is a fix: not handed out
  std::uint64_t unsettled =
      0;  // of the first after a start: the clocks were not tied yet, or turned back
  std::uint64_t other = 0;     // messages of other kinds
  std::uint64_t errors = 0;    // of these, errors that the device told
  std::uint64_t restarts = 0;  // the device restarted, or its clock was set
  std::uint64_t layout_wrong =
      0;  // of the malformed: MTData of another length than the settings say
  std::uint8_t last_error = 0;
};

/// Bytes of a measuring device into readings with times.
///
///     decoder.begin(settings, 115200, Duration::milliseconds(2));
///     decoder.accept(bytes, arrival);  // of each read
///     for (InsReading reading; decoder.next(&reading);) use(reading.sample, reading.host);
///
/// Time     A reading's time is that of its sample by the device's clock, mapped to the host's by
///          ArrivalTiming. The receiver's messages are older than the inertial ones before them and
///          not in step: they say how good the fix is, and are no readings.
/// Order    Of measurement; a sample that is not newer than the last is counted and dropped.
/// Threads  One caller. Memory: in place, no heap.
/// Errors   Counted; nothing stops the stream.
class Decoder {
 public:
  Decoder() = default;
  /// Of a device that was set like this, on a line of this rate. Forgets everything but the
  /// counters and the numbers.
  void begin(const StreamSettings& stream, std::uint32_t baud, Duration processing) noexcept;
  /// What a read brought. Precondition: next() has said false since the last; at most kMostBytes.
  void accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept;
  static constexpr std::size_t kMostBytes = 4096;
  /// The next reading. False: none, *reading untouched.
  [[nodiscard]] bool next(InsReading* reading) noexcept;
  /// Nothing came for longer than a frame takes: what looked like the beginning of one was none.
  void quiet() noexcept { stream_.abandon(); }
  /// The device has told that it restarts, since the last call.
  [[nodiscard]] bool woke() noexcept;
  /// It has answered that it stopped measuring, or goes on: which of the two `request` is. Since
  /// the last call for that. The first reading after it goes on is `resumed`.
  [[nodiscard]] bool answered(xbus::MessageId request) noexcept;

  /// When the newest sample arrived; zero: none since begin().
  [[nodiscard]] HostStamp last_sample() const noexcept { return last_sample_; }
  [[nodiscard]] const DecoderCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] const xbus::StreamCounters& line_counters() const noexcept {
    return stream_.counters();
  }
  [[nodiscard]] const ArrivalTiming& timing() const noexcept { return timing_; }

 private:
  /// What the device told of itself that nobody has asked for yet, and of the next reading.
  struct Said {
    bool woke = false, stopped = false, going_on = false;
    bool resumed = false;
  };
  [[nodiscard]] bool take_mtdata2(const xbus::Message& message, std::uint64_t begin,
                                  std::uint64_t end, InsReading* reading) noexcept;
  [[nodiscard]] bool take_mtdata(const xbus::Message& message, std::uint64_t begin,
                                 std::uint64_t end, InsReading* reading) noexcept;
  void take_other(const xbus::Message& message) noexcept;
  [[nodiscard]] bool step(ClockStep step) noexcept;
  [[nodiscard]] bool finish(DeviceStamp measured, std::uint64_t begin, std::uint64_t end,
                            InsReading* reading) noexcept;
  [[nodiscard]] bool hand_out(const InsReading& r, InsReading* reading) noexcept;
  void count_messages(std::uint16_t counter) noexcept;

  StreamSettings set_{};
  xbus::FrameStream stream_;
  ArrivalTiming timing_;
  SampleTime sample_time_;
  SampleCounter sample_counter_;
  Receiver receiver_{};
  DecoderCounters counters_{};
  HostStamp arrival_{};      // of the newest read
  HostStamp last_sample_{};  // arrival of the newest sample
  HostStamp last_place_{};   // arrival of the newest sample with a position
  DeviceStamp last_{};       // the newest sample
  HostStamp last_host_{};    // of the newest reading
  std::uint64_t received_ = 0, base_ = 0;
  std::uint64_t number_ = 0;
  bool any_ = false, counted_ = false;
  Said said_{};
  std::uint16_t last_message_ = 0;
  std::uint8_t last_fix_age_ = 0;
};

}  // namespace vergence::xsens
