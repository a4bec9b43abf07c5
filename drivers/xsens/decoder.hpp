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

/// Derives the time of a sample from the arrival of its bytes.
///
/// Method   A USB converter delivers bytes in bursts, so the end of a message does not show when it
///          was sent. But the last byte of a read was on the wire just before the burst. The device
///          time when it was sent (sample + processing, or the end of the previous message if
///          later, + its position in the message at the baud rate) and the arrival are a pair for
///          the ClockMapper. A read that ends in an incomplete message waits for it. Pairs are
///          late, never early, as the mapper requires.
/// Memory   Fixed; beyond kMarks waiting reads the oldest is dropped.
/// Errors   The constant, unobservable minimum delay from the converter to the program remains in
///          the stamps (docs/ins.md).
///
/// Not thread-safe.
class ArrivalTiming {
 public:
  explicit ArrivalTiming(std::uint32_t baud = 115200, Duration processing = {}) noexcept;

  /// Starts a new fit, because the link was reopened or the device's clock was set. The byte count
  /// continues.
  void restart() noexcept;
  /// Records a read that ends at this byte count.
  void read(std::uint64_t end, HostStamp arrival) noexcept;
  /// Records a message of the bytes [begin, end) with this sample. `measured` increases.
  void message(std::uint64_t begin, std::uint64_t end, DeviceStamp measured) noexcept;
  /// Records that bytes up to `end` occupied the link but have no known time: garbage, or another
  /// message.
  void other(std::uint64_t end) noexcept;
  /// True once a read has ended inside a message, so that at() is available. Takes one burst, 61 ms
  /// at 115200 baud.
  [[nodiscard]] bool known() const noexcept { return known_; }
  /// Maps a sample's time to the host's clock. Precondition: known.
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
  // Sufficient: a 231-byte message in reads of 11 bytes needs 21.
  static constexpr std::size_t kMarks = 64;

  ClockMapper mapper_;
  Duration processing_;
  double byte_ns_;
  // Oldest first.
  std::array<Mark, kMarks> marks_{};
  std::size_t count_ = 0;
  // Byte count so far.
  std::uint64_t end_ = 0;
  // Earliest time when all of these bytes had been sent.
  DeviceStamp line_free_{};
  bool known_ = false, line_known_ = false;
  // Newest pair given to the mapper, and the result.
  DeviceStamp witness_{};
  MappedStamp mapped_{};
};

/// Relation of a new stamp to the last one.
enum class ClockStep : std::uint8_t {
  first,
  forward,
  /// Not later than the last one, so no new sample.
  backward,
  /// The clock was set, or the device restarted.
  restart,
};

/// Unwraps SampleTimeFine, in units of 0.1 ms. It wraps at one day on MTi 10/100 series and the
/// 700/710, at 2³² on others.
///
/// The result is the device's time since the first stamp; it continues across a restart by
/// `elapsed`. Not thread-safe.
class SampleTime {
 public:
  /// `elapsed` is the approximate host time since the last stamp.
  [[nodiscard]] ClockStep next(std::uint32_t ticks, Duration elapsed) noexcept;
  [[nodiscard]] DeviceStamp stamp() const noexcept { return DeviceStamp(ticks_ * kTick); }
  /// Unwraps a stamp near the last one, older or newer, without recording it.
  [[nodiscard]] std::optional<DeviceStamp> near(std::uint32_t ticks) const noexcept;

 private:
  // In ns.
  static constexpr std::int64_t kTick = 100'000;
  // In ticks.
  static constexpr std::int64_t kDay = 864'000'000;
  // In ticks.
  static constexpr std::int64_t kFull = 4'294'967'296;
  // In ticks (10 s): larger steps mean a clock that was set.
  static constexpr std::int64_t kFarthest = 100'000;
  [[nodiscard]] std::int64_t difference(std::uint32_t ticks) const noexcept;

  bool known_ = false;
  // Last raw value.
  std::uint32_t last_ = 0;
  // Unwrapped ticks.
  std::int64_t ticks_ = 0;
};

/// Unwraps the MTi-G's 16-bit sample counter.
class SampleCounter {
 public:
  [[nodiscard]] ClockStep next(std::uint16_t counter, std::int64_t expected_steps) noexcept;
  [[nodiscard]] std::int64_t count() const noexcept { return count_; }

 private:
  bool known_ = false;
  std::uint16_t last_ = 0;
  std::int64_t count_ = 0;
};

/// Attitude sensor → ENU as quaternion x y z w, from sensor → `frame` as w x y z; normalised.
/// Returns nothing for an invalid quaternion.
///   NWU: q_enu = (√½, 0, 0, √½) ⊗ q      x north becomes y
///   NED: q_enu = (0, √½, √½, 0) ⊗ q      x and y are swapped, z is reversed
/// The sensor's axes are those on its housing in every frame; the boresight describes its mounting.
[[nodiscard]] std::optional<std::array<double, 4>> enu_attitude(const std::array<double, 4>& wxyz,
                                                                xbus::LocalFrame frame) noexcept;
[[nodiscard]] std::array<double, 3> enu_vector(const xbus::Three& v,
                                               xbus::LocalFrame frame) noexcept;

/// Newest status of the receiver's fix.
struct Receiver {
  bool known = false;
  HostStamp received{};
  /// As in GnssPvt.
  std::uint8_t fix = 0;
  std::uint8_t satellites = 0;
  float position_dop = 0;
  /// Standard deviations per axis in m, m and m/s; 0 if unknown.
  double position_sigma = 0, height_sigma = 0, velocity_sigma = 0;
};
[[nodiscard]] Receiver to_receiver(const xbus::GnssPvt& pvt, HostStamp received) noexcept;
[[nodiscard]] Receiver to_receiver(const xbus::LegacyFix& fix, std::uint8_t status,
                                   HostStamp received) noexcept;

/// Fills attitude, velocity, position, fix, sigmas and quality; the caller sets number and times.
/// Absent fields stay invalid. A receiver status older than kReceiverStale is ignored.
inline constexpr Duration kReceiverStale = Duration::seconds(3);
void fill(const xbus::Mtdata2& data, const Receiver& receiver, HostStamp now,
          InsReading* reading) noexcept;
void fill(const xbus::Mtdata& data, const Receiver& receiver, HostStamp now,
          InsReading* reading) noexcept;

/// Counters of a stream; all only grow.
struct DecoderCounters {
  std::uint64_t readings = 0;
  /// Messages (MTi-G-700/710) or samples (MTi-G) missing in the device's count.
  std::uint64_t lost = 0;
  /// Complete frames that could not be decoded.
  std::uint64_t malformed = 0;
  /// Restarts of the device and steps of its clock.
  std::uint64_t restarts = 0;
};

/// Decodes the bytes of a measuring device into samples with times.
///
///     decoder.begin(settings, 115200, Duration::milliseconds(2));
///     decoder.accept(bytes, arrival);  // of each read
///     for (InsReading reading; decoder.next(&reading);) use(reading.sample, reading.host);
///
/// Time     The sample's time on the device's clock is mapped to the host's by ArrivalTiming. The
///          receiver's messages are older than the inertial ones and not synchronous: they give the
///          quality of the fix, not samples.
/// Order    By measurement; a sample that is not newer than the last is dropped.
/// Errors   Counted; the stream always continues.
///
/// Not thread-safe. Does not allocate.
class Decoder {
 public:
  Decoder() = default;
  /// Starts decoding of a device with these settings and baud rate. Clears everything but the
  /// counters and the numbers.
  void begin(const StreamSettings& stream, std::uint32_t baud, Duration processing) noexcept;
  /// Adds the bytes of a read, at most kMaxBytes. Precondition: next() has returned false since the
  /// last call.
  void accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept;
  static constexpr std::size_t kMaxBytes = 4096;
  /// Returns the next sample. If false, *reading is unchanged.
  [[nodiscard]] bool next(InsReading* reading) noexcept;
  /// Called after a silence longer than a frame: an incomplete frame is discarded.
  void quiet() noexcept { stream_.abandon(); }
  /// True if the device has reported a restart since the last call.
  [[nodiscard]] bool woke() noexcept;
  /// True if the device has confirmed `request` (stop or resume measuring) since the last such
  /// call. The first sample after resuming is `resumed`.
  [[nodiscard]] bool answered(xbus::MessageId request) noexcept;

  /// Arrival of the newest sample; zero if none since begin().
  [[nodiscard]] HostStamp last_sample() const noexcept { return last_sample_; }
  [[nodiscard]] const DecoderCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] const xbus::StreamCounters& line_counters() const noexcept {
    return stream_.counters();
  }
  [[nodiscard]] const ArrivalTiming& timing() const noexcept { return timing_; }

 private:
  /// Replies of the device that were not queried yet, and a flag of the next sample.
  struct Replies {
    bool woke = false, stopped = false, going_on = false;
    bool resumed = false;
  };
  [[nodiscard]] bool read_mtdata2(const xbus::Message& message, std::uint64_t begin,
                                  std::uint64_t end, InsReading* reading) noexcept;
  [[nodiscard]] bool read_mtdata(const xbus::Message& message, std::uint64_t begin,
                                 std::uint64_t end, InsReading* reading) noexcept;
  void read_other(const xbus::Message& message) noexcept;
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
  // Arrival of the newest read.
  HostStamp arrival_{};
  // Arrival of the newest sample.
  HostStamp last_sample_{};
  // Arrival of the newest sample with a position.
  HostStamp last_place_{};
  // Time of the newest sample.
  DeviceStamp last_{};
  // Host time of the newest sample.
  HostStamp last_host_{};
  std::uint64_t received_ = 0, base_ = 0;
  std::uint64_t number_ = 0;
  bool any_ = false, counted_ = false;
  Replies replies_{};
  std::uint16_t last_message_ = 0;
  std::uint8_t last_fix_age_ = 0;
};

}  // namespace vergence::xsens
