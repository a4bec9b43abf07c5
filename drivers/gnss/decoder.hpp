#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/gnss/options.hpp"
#include "drivers/ins.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "firmware_iface/nmea/nmea.hpp"
#include "firmware_iface/ubx/ubx.hpp"

namespace vergence::gnss {

/// Below this speed a course is noise.
inline constexpr double kMoving = 1.0;  // m/s

/// A fix with the time that the receiver gives it.
struct Fix {
  DeviceStamp measured{};  // UTC since 1970; without a date, since the midnight before the first
  HostStamp arrival{};     // of the epoch's first message
  std::size_t bytes = 0;   // of that message
  InsReading reading{};    // sample and quality; no stamps
};

/// NMEA sentences into fixes: those of one time of day are one epoch.
///
/// Method   An epoch is complete when it has every type of sentence the one before had, when a
///          sentence has another time, or when the line goes quiet (flush()). VTG and HDT have no
///          time: the newest is used while it is fresh.
/// Threads  One caller. Memory: fixed.
class NmeaEpochs {
 public:
  /// True: *fix is a complete epoch. A sentence of the next one is kept.
  [[nodiscard]] bool accept(const nmea::Sentence& sentence, std::size_t bytes, HostStamp arrival,
                            Fix* fix) noexcept;
  /// The line is quiet. True: the open epoch is complete.
  [[nodiscard]] bool flush(Fix* fix) noexcept;
  /// The line was opened again.
  void restart() noexcept;

 private:
  struct Motion {
    std::optional<double> speed, course_deg;
    HostStamp at{};
  };
  void begin(const nmea::Sentence& sentence, std::size_t bytes, HostStamp arrival) noexcept;
  void merge(const nmea::Sentence& sentence) noexcept;
  void finish(Fix* fix) noexcept;
  [[nodiscard]] DeviceStamp stamp() noexcept;

  bool open_ = false;
  std::int64_t time_ = -1, last_time_ = -1;  // ns of the day, of the open epoch, of the one before
  std::optional<std::int32_t> date_;         // of the open epoch
  std::int64_t days_ = 0, previous_ = 0;     // date of the newest epoch, and its time of day
  bool dated_ = false;
  HostStamp arrival_{};
  std::size_t bytes_ = 0;
  unsigned types_ = 0, usual_ = 0;  // bit by Type: of the open epoch, of the one before
  nmea::Sentence gga_{}, rmc_{}, gst_{};
  Motion vtg_{};
  std::optional<double> heading_deg_;
  HostStamp heading_at_{};
};

/// ENU yaw of a compass heading, rad in (−π, π].
[[nodiscard]] double yaw_of_heading(double heading_deg) noexcept;

/// Counters of a stream; all only grow.
struct DecoderCounters {
  std::uint64_t readings = 0;
  std::uint64_t lost = 0;       // epochs missing between two, by the receiver's interval
  std::uint64_t malformed = 0;  // sentences and frames that made no sense
  std::uint64_t restarts = 0;   // the receiver's clock was set
};

/// Bytes of a satellite receiver into readings with times.
///
/// Time     A fix's UTC is the device's clock, mapped to the host's by a ClockMapper: the bytes of
///          an epoch's first message arrive Options::processing and their time on the wire after
///          the fix, or later. By what `processing` is wrong all stamps are, beyond their bound.
/// Order    Of measurement; a fix that is not newer than the last, or without a time, is dropped.
/// Threads  One caller. Memory: in place, no heap.
/// Errors   Counted; nothing stops the stream.
class Decoder {
 public:
  static constexpr std::size_t kMaxBytes = 1024;

  explicit Decoder(const Options& options) noexcept;
  /// The line was opened, at this rate; 0: bytes take no time (USB). Counters go on.
  void begin(std::uint32_t baud) noexcept;
  /// Adds the bytes of a read. Precondition: next() has said false since the last; at most
  /// kMaxBytes.
  void accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept;
  /// The next reading. False: none, *reading untouched.
  [[nodiscard]] bool next(InsReading* reading) noexcept;
  /// The line was quiet for longer than a pause within an epoch: what waits is complete.
  void quiet() noexcept { quiet_ = true; }

  /// The receiver's interval since begin(): the shortest between two fixes that came several times
  /// in a row, until then the first; 0: not known yet.
  [[nodiscard]] Duration period() const noexcept { return period_.interval(); }
  /// Whole messages of either protocol, right in checksum.
  [[nodiscard]] std::uint64_t sentences() const noexcept { return nmea_.counters().sentences; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return ubx_.counters().frames; }
  /// Messages that hold a fix, of the protocol asked for.
  [[nodiscard]] std::uint64_t fixes() const noexcept { return fixes_; }
  [[nodiscard]] HeadingSource best_heading() const noexcept { return best_heading_; }
  [[nodiscard]] DecoderCounters counters() const noexcept;

 private:
  /// The receiver's interval. A single short step, as where a fix is acquired again, is none.
  class Period {
   public:
    void add(Duration step) noexcept;
    [[nodiscard]] Duration interval() const noexcept { return interval_; }

   private:
    Duration interval_{}, newest_{};
    int alike_ = 0;      // newest steps
    bool sure_ = false;  // the interval came several times in a row
  };

  [[nodiscard]] bool next_nmea(Fix* fix) noexcept;
  [[nodiscard]] bool next_ubx(Fix* fix) noexcept;
  [[nodiscard]] bool map(const Fix& fix, InsReading* reading) noexcept;
  [[nodiscard]] MappedStamp host_stamp(const Fix& fix, HostStamp arrival) noexcept;
  void count(Duration step) noexcept;

  Options options_;
  ClockMapper mapper_;
  double byte_ns_ = 0;
  std::array<std::uint8_t, kMaxBytes> bytes_{};
  std::size_t at_ = 0, size_ = 0;  // of bytes_: not read yet, of the newest read
  HostStamp arrival_{};
  bool quiet_ = false;
  nmea::SentenceStream nmea_;
  NmeaEpochs epochs_;
  ubx::FrameStream ubx_;
  DecoderCounters counters_{};
  std::uint64_t fixes_ = 0, number_ = 0;
  HeadingSource best_heading_ = HeadingSource::none;
  Period period_;
  bool any_ = false;
  DeviceStamp last_{};
  HostStamp last_host_{};
};

}  // namespace vergence::gnss
