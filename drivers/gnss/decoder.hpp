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

/// Speed below which a course is noise, in m/s.
inline constexpr double kMoving = 1.0;

/// Fix with the receiver's time.
struct Fix {
  /// UTC since 1970 or, without a date, since midnight before the first fix.
  DeviceStamp measured{};
  /// Arrival of the epoch's first message.
  HostStamp arrival{};
  /// Size of that message.
  std::size_t bytes = 0;
  /// Sample and quality, without stamps.
  InsReading reading{};
};

/// Groups NMEA sentences into fixes; those of one time of day form an epoch.
///
/// An epoch is complete when it has every type of sentence of the previous one, when a sentence has
/// another time, or when the link is quiet (flush()). VTG and HDT have no time: the newest is used
/// while it is fresh. Not thread-safe. Fixed memory.
class NmeaEpochs {
 public:
  /// Returns true if *fix is a complete epoch. A sentence of the next one is kept.
  [[nodiscard]] bool accept(const nmea::Sentence& sentence, std::size_t bytes, HostStamp arrival,
                            Fix* fix) noexcept;
  /// Called when the link is quiet. Returns true if the open epoch is complete.
  [[nodiscard]] bool flush(Fix* fix) noexcept;
  /// Called after the link was reopened.
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
  // Time of day in ns, of the open epoch and the previous one.
  std::int64_t time_ = -1, last_time_ = -1;
  // Date of the open epoch.
  std::optional<std::int32_t> date_;
  // Date of the newest epoch, and its time of day.
  std::int64_t days_ = 0, previous_ = 0;
  bool dated_ = false;
  HostStamp arrival_{};
  std::size_t bytes_ = 0;
  // Bit sets by Type, of the open epoch and the previous one.
  unsigned types_ = 0, usual_ = 0;
  nmea::Sentence gga_{}, rmc_{}, gst_{};
  Motion vtg_{};
  std::optional<double> heading_deg_;
  HostStamp heading_at_{};
};

/// ENU yaw of a compass heading, in rad, in (−π, π].
[[nodiscard]] double yaw_of_heading(double heading_deg) noexcept;

/// Counters of a stream; all only grow.
struct DecoderCounters {
  std::uint64_t readings = 0;
  /// Epochs missing between two others, by the receiver's interval.
  std::uint64_t lost = 0;
  /// Sentences and frames that could not be decoded.
  std::uint64_t malformed = 0;
  /// Steps of the receiver's clock.
  std::uint64_t restarts = 0;
};

/// Decodes the bytes of a satellite receiver into samples with times.
///
/// Time     A fix's UTC is the device's clock, mapped to the host's by a ClockMapper: an epoch's
///          first message arrives no earlier than Options::processing plus its wire time after the
///          fix. An error of `processing` shifts all stamps, beyond their bound.
/// Order    By measurement; a fix that is not newer than the last, or without a time, is dropped.
/// Errors   Counted; the stream always continues.
///
/// Not thread-safe. Does not allocate.
class Decoder {
 public:
  static constexpr std::size_t kMaxBytes = 1024;

  explicit Decoder(const Options& options) noexcept;
  /// Called after the link was opened at this rate; 0 if bytes have no wire time (USB). Counters
  /// continue.
  void begin(std::uint32_t baud) noexcept;
  /// Adds the bytes of a read, at most kMaxBytes. Precondition: next() has returned false since the
  /// last call.
  void accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept;
  /// Returns the next sample. If false, *reading is unchanged.
  [[nodiscard]] bool next(InsReading* reading) noexcept;
  /// Called after a silence longer than pauses within an epoch; waiting data are then complete.
  void quiet() noexcept { quiet_ = true; }

  /// Interval of the receiver since begin(): the shortest that repeated several times, before that
  /// the first; 0 if unknown.
  [[nodiscard]] Duration period() const noexcept { return period_.interval(); }
  /// Messages of either protocol with a correct checksum.
  [[nodiscard]] std::uint64_t sentences() const noexcept { return nmea_.counters().sentences; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return ubx_.counters().frames; }
  /// Messages of the selected protocol with a fix.
  [[nodiscard]] std::uint64_t fixes() const noexcept { return fixes_; }
  [[nodiscard]] HeadingSource best_heading() const noexcept { return best_heading_; }
  [[nodiscard]] DecoderCounters counters() const noexcept;

 private:
  /// Estimates the receiver's interval. A single short step, as at reacquisition of a fix, is
  /// ignored.
  class Period {
   public:
    void add(Duration step) noexcept;
    [[nodiscard]] Duration interval() const noexcept { return interval_; }

   private:
    Duration interval_{}, newest_{};
    // Number of equal newest steps.
    int alike_ = 0;
    // True once the interval repeated several times.
    bool sure_ = false;
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
  // Read position in bytes_, and size of the newest read.
  std::size_t at_ = 0, size_ = 0;
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
