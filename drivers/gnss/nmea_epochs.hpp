#pragma once
#include <cstdint>
#include <optional>

#include "drivers/ins.hpp"
#include "firmware_iface/nmea/nmea.hpp"

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

}  // namespace vergence::gnss
