#pragma once
#include <cstdint>
#include <memory>

#include "app/device_replay/recorded_line.hpp"
#include "drivers/trigger_board/device.hpp"

namespace vergence::app {

/// A board's driver on a recorded line, which is asked for pauses where it was in the drive: what
/// its caller asks for comes at another time than it did then, and so does what the board said
/// about it.
///
/// Ownership  `line` is in `board`.
/// Threads, errors, time: as those of `board`.
class RecordedBoard final : public TriggerDevice {
 public:
  RecordedBoard(std::unique_ptr<trigger_board::Device> board, RecordedPlace& line);

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
  std::unique_ptr<trigger_board::Device> board_;
};

}  // namespace vergence::app
