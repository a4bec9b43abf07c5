#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/device.hpp"
#include "drivers/ins.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/xsens/options.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::xsens {

/// When the device measured, from when its bytes arrived.
///
/// Method   A USB converter hands bytes over in bursts, so a message's end says little about when
///          it was sent. But the last byte of a read was on the wire just before the burst left: it
///          is given the device's time at which it was sent (sample + processing, or the end of the
///          message before where that is later, + its place in the message at the baud rate), and
///          this pair goes into the ClockMapper. A read whose last byte is in a message that is not
///          whole yet waits for it. All pairs are late, never early, as the mapper wants them.
/// Threads  One caller. Memory: fixed; of reads that wait the oldest go when there are more than
///          kMarks.
/// Errors   None. What is constant and unseen, the least time from the converter to the program,
///          stays in the stamps (docs/ins.md).
class ArrivalTiming {
 public:
  explicit ArrivalTiming(std::uint32_t baud = 115200, Duration processing = {}) noexcept;

  /// Everything anew: the line was opened again, or the device's clock was set. The stream's count
  /// goes on.
  void restart() noexcept;
  /// A read brought the stream up to this count of bytes.
  void read(std::uint64_t end, HostStamp arrival) noexcept;
  /// A message of the stream's bytes [begin, end), of this sample. `measured` ascends.
  void message(std::uint64_t begin, std::uint64_t end, DeviceStamp measured) noexcept;
  /// Bytes up to `end` say nothing about when they were sent, but that the line was taken: garbage,
  /// or another message.
  void other(std::uint64_t end) noexcept;
  /// A read has ended inside a message since the start: at() has something to say. Takes a burst,
  /// 61 ms at 115200 baud.
  [[nodiscard]] bool known() const noexcept { return known_; }
  /// The host's time of a sample. Precondition: known.
  [[nodiscard]] MappedStamp at(DeviceStamp measured) const noexcept;

  [[nodiscard]] double drift() const noexcept { return mapper_.drift(); }
  [[nodiscard]] std::uint64_t resets() const noexcept { return mapper_.resets(); }

 private:
  void drop_marks(std::uint64_t end) noexcept;
  [[nodiscard]] Duration wire_time(std::uint64_t bytes) const noexcept;
  struct Mark {
    std::uint64_t end = 0;
    HostStamp arrival{};
  };
  static constexpr std::size_t kMarks = 64;  // a 231-byte message in reads of 11 bytes has 21

  ClockMapper mapper_;
  Duration processing_;
  double byte_ns_;
  std::array<Mark, kMarks> marks_{};  // oldest first
  std::size_t count_ = 0;
  std::uint64_t end_ = 0;    // of the bytes seen so far
  DeviceStamp line_free_{};  // when the last of them had been sent, at the earliest
  bool known_ = false, line_known_ = false;
  DeviceStamp witness_{};  // the newest pair given to the mapper …
  MappedStamp mapped_{};   // … and what it said
};

/// Relation of a new stamp to the last one.
enum class ClockStep : std::uint8_t {
  first,
  forward,
  backward,  // not after the last one: not a new sample
  restart,   // the clock was set, or the device restarted
};

/// Unwraps SampleTimeFine: 0.1 ms, wrapping at one day on MTi 10/100 series and the 700/710, at 2³²
/// on others.
///
/// Threads  One caller. Time: the device's, from the first stamp on; goes on over a restart by what
///          `elapsed` says has passed.
class SampleTime {
 public:
  /// `elapsed`: of the host's clock since the last stamp, roughly.
  [[nodiscard]] ClockStep next(std::uint32_t ticks, Duration elapsed) noexcept;
  [[nodiscard]] DeviceStamp stamp() const noexcept { return DeviceStamp(ticks_ * kTick); }
  /// The unwrapped time of a stamp near the last one, older or newer, without taking it.
  [[nodiscard]] std::optional<DeviceStamp> near(std::uint32_t ticks) const noexcept;

 private:
  static constexpr std::int64_t kTick = 100'000;        // ns
  static constexpr std::int64_t kDay = 864'000'000;     // ticks
  static constexpr std::int64_t kFull = 4'294'967'296;  // ticks
  static constexpr std::int64_t kFarthest =
      100'000;  // ticks, 10 s: a gap, beyond it a clock that was set
  [[nodiscard]] std::int64_t difference(std::uint32_t ticks) const noexcept;

  bool known_ = false;
  std::uint32_t last_ = 0;  // as sent
  std::int64_t ticks_ = 0;  // unwrapped
};

/// Unwraps the MTi-G's sample counter, 16 bits.
class SampleCounter {
 public:
  [[nodiscard]] ClockStep next(std::uint16_t counter, std::int64_t expected_steps) noexcept;
  [[nodiscard]] std::int64_t count() const noexcept { return count_; }

 private:
  bool known_ = false;
  std::uint16_t last_ = 0;
  std::int64_t count_ = 0;
};

/// Quaternion x y z w, sensor → ENU, of one w x y z, sensor → `frame`; normalised. Nothing: it is
/// none.
///   NWU: q_enu = (√½, 0, 0, √½) ⊗ q      x north becomes y
///   NED: q_enu = (0, √½, √½, 0) ⊗ q      x and y change places, z turns over
/// The sensor's own axes are those printed on its housing in every frame; how it is mounted is the
/// boresight's affair.
[[nodiscard]] std::optional<std::array<double, 4>> enu_attitude(const std::array<double, 4>& wxyz,
                                                                xbus::LocalFrame frame) noexcept;
[[nodiscard]] std::array<double, 3> enu_vector(const xbus::Three& v,
                                               xbus::LocalFrame frame) noexcept;

/// The receiver's newest word about its fix.
struct Receiver {
  bool known = false;
  HostStamp received{};
  std::uint8_t fix = 0;  // as GnssPvt
  std::uint8_t satellites = 0;
  float position_dop = 0;
  double position_sigma = 0, height_sigma = 0,
         velocity_sigma = 0;  // m, m, m/s, each axis; 0: not told
};
[[nodiscard]] Receiver receiver_of(const xbus::GnssPvt& pvt, HostStamp received) noexcept;
[[nodiscard]] Receiver receiver_of(const xbus::LegacyFix& fix, std::uint8_t status,
                                   HostStamp received) noexcept;

/// Fills attitude, velocity, position, fix, sigmas and quality; number and times are the caller's.
/// Absent fields stay invalid. A receiver's word older than kReceiverStale is not used.
inline constexpr Duration kReceiverStale = Duration::seconds(3);
void fill(const xbus::Mtdata2& data, const Receiver& receiver, HostStamp now,
          InsReading* reading) noexcept;
void fill(const xbus::Mtdata& data, const Receiver& receiver, HostStamp now,
          InsReading* reading) noexcept;

/// Counters of a stream; all only grow.
struct DecoderCounters {
  std::uint64_t readings = 0;
  std::uint64_t lost =
      0;  // messages (MTi-G-700/710) or samples (MTi-G) missing in the device's count
  std::uint64_t malformed = 0;  // whole frames that made no sense
  std::uint64_t restarts = 0;   // the device restarted, or its clock was set
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
/// Order    Of measurement; a sample that is not newer than the last is dropped.
/// Threads  One caller. Memory: in place, no heap.
/// Errors   Counted; nothing stops the stream.
class Decoder {
 public:
  Decoder() = default;
  /// Starts decoding of a device with these settings and baud rate. Clears everything but the
  /// counters and the numbers.
  void begin(const StreamSettings& stream, std::uint32_t baud, Duration processing) noexcept;
  /// Adds the bytes of a read. Precondition: next() has said false since the last; at most
  /// kMaxBytes.
  void accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept;
  static constexpr std::size_t kMaxBytes = 4096;
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
  /// Status of the device that was not read yet, and of the next sample.
  struct Replies {
    bool woke = false, stopped = false, going_on = false;
    bool resumed = false;
  };
  [[nodiscard]] bool read_mtdata2(const xbus::Message& message, std::uint64_t begin,
                                  std::uint64_t end, InsReading* reading) noexcept;
  [[nodiscard]] bool read_mtdata(const xbus::Message& message, std::uint64_t begin,
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
  Replies replies_{};
  std::uint16_t last_message_ = 0;
  std::uint8_t last_fix_age_ = 0;
};

}  // namespace vergence::xsens
