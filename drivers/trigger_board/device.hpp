#pragma once
#include <memory>
#include <string>

#include "core/math/random.hpp"
#include "drivers/common/last_error.hpp"
#include "drivers/common/published.hpp"
#include "drivers/common/serial_device.hpp"
#include "drivers/trigger.hpp"
#include "drivers/trigger_board/board_line.hpp"
#include "drivers/trigger_board/board_receiver.hpp"
#include "drivers/trigger_board/options.hpp"
#include "drivers/trigger_board/setup.hpp"

namespace vergence::trigger_board {

/// Trigger board on a serial link, with the contract of TriggerDevice.
///
/// connect() and configure() access the trigger board and usually take up to a second, at most
/// seven without an answer. start() returns immediately: a thread synchronises clocks, starts the
/// board, reads, and after `disconnected` reopens and configures it again. A board that sends
/// nothing for kSilent counts as disconnected. One that restarts (another boot_id) is configured
/// and started again; pulses of another `boot` follow. Pulses that continued while the link was
/// down are resumed.
/// Time     Pulses are mapped by pings: kFirstPings before the start, then one every
///          Options::ping_interval. Without answers they are unmapped.
/// Memory   The thread allocates only while the board is disconnected or being configured.
class Device final : public TriggerDevice, private SerialDevice<Pulse, 256> {
 public:
  static constexpr Duration kSilent = Duration::seconds(1);
  static constexpr int kFirstPings = 8;

  Device(std::unique_ptr<SerialLinkFactory> place, const Options& options);
  ~Device() override;

  /// Opens the link and identifies the device. → ok, not_found (another make, or no answer),
  /// no_permission, busy, unsupported (another protocol version), disconnected, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] DeviceStatus configure(const TriggerConfiguration& requested,
                                       TriggerConfiguration* actual) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override { return timing_; }
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept override;
  [[nodiscard]] DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override;
  [[nodiscard]] DeviceStatus pause(std::uint32_t pulses) noexcept override;
  void stop() noexcept override;
  [[nodiscard]] std::string last_error() const override { return last_error_.get(); }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] TriggerStatistics statistics() const noexcept override;

  /// Identity reported by the trigger board. Precondition: connected.
  [[nodiscard]] const TriggerInfo& identity() const noexcept { return identity_; }

 private:
  [[nodiscard]] DeviceStatus open();
  [[nodiscard]] DeviceStatus meet(TriggerInfo* who);
  [[nodiscard]] DeviceStatus set_up();
  [[nodiscard]] Duration byte_time() const noexcept;

  [[nodiscard]] DeviceStatus begin() noexcept override;
  [[nodiscard]] DeviceStatus begin_on(Setup* setup);
  [[nodiscard]] DeviceStatus tie_clocks() noexcept;
  [[nodiscard]] DeviceStatus read_on() noexcept override;
  [[nodiscard]] DeviceStatus reopen() override;
  void interrupted(DeviceStatus status) noexcept override;
  void finished() noexcept override;
  [[nodiscard]] DeviceStatus read_one(HostStamp deadline) noexcept;
  void halt_board() noexcept;
  [[nodiscard]] std::uint32_t open_reports() const noexcept;
  void ping(HostStamp now) noexcept;
  void send_pause(HostStamp now) noexcept;
  void publish(bool last) noexcept;
  void go_streaming(HostStamp now) noexcept;

  const Options options_;
  DeviceInfo info_;
  TriggerInfo identity_{};
  TriggerConfig config_{};
  // Mark of config_ in STATUS.
  std::uint32_t mark_ = 0;
  // Baud rate of the last answer; 0 if unknown.
  std::uint32_t baud_ = 0;
  bool connected_ = false, configured_ = false;
  DeviceTiming timing_{};
  std::string remark_;
  LastError last_error_;
  PauseRequest pause_;

  // The following members belong to the thread while it runs, else to the owner.
  BoardLine frames_;
  BoardReceiver receiver_;
  Random dither_{1, 63};
  // True if it was started and, as far as known, makes pulses.
  bool running_ = false;

  // Written by the thread, without the counters of SerialDevice.
  Published<TriggerStatistics> statistics_;
};

}  // namespace vergence::trigger_board
