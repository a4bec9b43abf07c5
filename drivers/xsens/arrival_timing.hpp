#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/clock_mapper.hpp"

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

}  // namespace vergence::xsens
