#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "app/datasets/device_recording.hpp"
#include "drivers/serial/byte_line.hpp"

namespace vergence::app {

/// How well a driver kept to the conversation that was recorded.
struct LineReplayCounters {
  std::uint64_t reads = 0;     // handed to the driver
  std::uint64_t writes = 0;    // that it made as recorded
  std::uint64_t not_made = 0;  // recorded, and not made by it
  std::uint64_t in_place = 0;  // made by it with other bytes, where one was recorded
  std::uint64_t other = 0;     // made by it where none was recorded
};

/// The port of a device in a recorded drive: a driver that behaves as it did then reads what it
/// read then, at the same times of its clock.
///
/// Time     Virtual: the recording's. A read brings what the next read brought then, bytes or
///          nothing, whatever its limit: a thread may have been late. Before the driver writes, the
///          clock shows what it showed it then; what it does not write is passed over after a few
///          reads that were woken (`stopped`) for it.
/// Ownership  The record outlives the place and its lines. Threads: as LinePlace, one line at a
///            time; counters(): when no line is in use.
/// A limit  What a driver does because of another thread (a pause, the end) comes when it comes,
///          unless before_writes() is used to make it come where it came.
class RecordedPlace final : public LinePlace {
 public:
  /// `until`: steps after it are not there.
  explicit RecordedPlace(const LineRecord& record, HostStamp until = HostStamp(INT64_MAX));
  ~RecordedPlace() override;

  /// The next line that was opened; when there is none, one that has ended.
  [[nodiscard]] std::unique_ptr<ByteLine> open(const LineSettings& settings,
                                               DeviceStatus* status) override;
  [[nodiscard]] std::string name() const override;
  [[nodiscard]] Duration latency_timer() const override;
  [[nodiscard]] bool pass(Duration /*time*/) override { return true; }
  [[nodiscard]] bool exhausted() const noexcept override;

  [[nodiscard]] const LineReplayCounters& counters() const noexcept;
  /// `call` with the bytes of a recorded write that the driver has not made, once for each of them:
  /// when it is the next to come and the driver looks at its clock, on that thread. While no line
  /// is in use.
  void before_writes(std::function<void(std::span<const std::uint8_t>)> call);

  class Conversation;  // where in the record it is; lives as long as the place or a line of it

 private:
  std::shared_ptr<Conversation> conversation_;
};

}  // namespace vergence::app
