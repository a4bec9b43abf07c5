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

/// A trigger board on a serial line.
///
/// As TriggerDevice says. connect() and configure() talk to the board and may take a second, at
/// most seven where none answers. start() never waits: a thread of the device's own asks for the
/// board's time, starts it, reads, and after `disconnected` opens and sets it again until it is
/// back. A board that says nothing for kSilent is gone. One that begins again (another boot_id) is
/// configured and started by itself, the pulses of another `boot` follow. A board that kept its
/// pulses going while the line was away goes on with them.
/// Time     Pulses are mapped: by pings, kFirstPings of them before the board starts, then every
///          Options::ping_interval. Where it answers none, they come unmapped.
/// Memory   The thread allocates only while the board is gone or begins again.
class Device final : public TriggerDevice,
                     private SerialDevice<Pulse, 256> {  // pulses: eight seconds at 30 Hz
 public:
  static constexpr Duration kSilent = Duration::seconds(1);
  static constexpr int kFirstPings = 8;

  Device(std::unique_ptr<SerialLinkFactory> place, const Options& options);
  ~Device() override;

  /// Opens the line and identifies the device. → ok, not_found (another make, or no answer),
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

  /// Identity reported by the board. Precondition: connected.
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
  std::uint32_t mark_ = 0;  // of config_, in STATUS
  std::uint32_t baud_ = 0;  // at which the board last answered; 0: not yet
  bool connected_ = false, configured_ = false;
  DeviceTiming timing_{};
  std::string remark_;
  LastError last_error_;
  PauseRequest pause_;

  // From here on: of the thread while it runs, else the owner's.
  BoardLine frames_;
  BoardReceiver receiver_;
  Random dither_{1, 63};
  bool running_ = false;  // it was started and makes pulses, as far as we know

  Published<TriggerStatistics> statistics_;  // of the thread, without what SerialDevice counts
};

}  // namespace vergence::trigger_board
