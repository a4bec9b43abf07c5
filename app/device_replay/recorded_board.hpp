#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "app/device_replay/recorded_line.hpp"
#include "drivers/trigger.hpp"

namespace vergence::app {

/// A pause of the pulses as it was first asked of a board.
struct RequestedPause {
  std::size_t step = 0;      // of the record: where its message was written
  std::uint32_t pulses = 0;  // without those of an earlier one that was asked for with it again
};

/// All of a record, in order. What the driver sent again by itself, its answer missing, is none.
[[nodiscard]] std::vector<RequestedPause> requested_pauses(const LineRecord& record);

/// A board's driver on a recorded line, which is asked for pauses where it was in the drive: what
/// its caller asks for comes at another time than it did then, and so does what the board said
/// about it.
///
/// Ownership  `line` is in `board`; the record outlives the construction alone.
/// Threads, errors, time: as those of `board`.
class RecordedBoard final : public TriggerDevice {
 public:
  RecordedBoard(std::unique_ptr<TriggerDevice> board, const LineRecord& record,
                RecordedPlace& line);

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return board_->info(); }
  [[nodiscard]] DeviceStatus configure(const TriggerConfiguration& requested,
                                       TriggerConfiguration* actual) noexcept override {
    return board_->configure(requested, actual);
  }
  [[nodiscard]] DeviceTiming timing() const noexcept override { return board_->timing(); }
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept override {
    return board_->start(ready);
  }
  [[nodiscard]] DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override {
    return board_->wait(limit, pulse);
  }
  /// Whether it could be; no pulse is left out for it that was not left out then.
  [[nodiscard]] DeviceStatus pause(std::uint32_t /*pulses*/) noexcept override {
    return board_->pause(0);
  }
  void stop() noexcept override { board_->stop(); }
  bool observe_line(LineObserver* observer) noexcept override {
    return board_->observe_line(observer);
  }
  [[nodiscard]] std::string last_error() const override { return board_->last_error(); }
  [[nodiscard]] std::string remark() const override { return board_->remark(); }
  [[nodiscard]] TriggerStatistics statistics() const noexcept override {
    return board_->statistics();
  }

 private:
  std::vector<RequestedPause> pauses_;
  std::size_t next_ = 0;                  // of the board's thread
  std::unique_ptr<TriggerDevice> board_;  // the first to go: its thread uses the others
};

}  // namespace vergence::app
