#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include "core/math/random.hpp"
#include "drivers/common/serial_device.hpp"
#include "drivers/trigger.hpp"
#include "drivers/trigger_board/board_clock.hpp"
#include "drivers/trigger_board/board_line.hpp"
#include "drivers/trigger_board/options.hpp"
#include "drivers/trigger_board/pulse_account.hpp"
#include "drivers/trigger_board/setup.hpp"

namespace vergence::trigger_board {

/// All that a board's driver counts and measures, for reports. Counters since open.
struct BoardStatistics {
  LineCounters line{};  // frames, and what was none
  PulseCounters pulses{};
  std::uint64_t frames_unknown =
      0;                     // right frames of a type or size that this protocol does not have
  std::uint64_t errors = 0;  // ERROR messages that no one waited for
  std::uint64_t writes_refused = 0;     // questions that the line did not take
  std::uint64_t reboots = 0, gone = 0;  // begun again; the line was lost
  std::uint64_t restarts = 0;           // it had stopped by itself, and was started again
  std::uint64_t pps_edges = 0, ins_edges = 0;
  TimeQuality time{};
  TriggerStatus board{};  // its newest own word; all zero before the first
};

/// A trigger board on a serial line.
///
/// As TriggerDevice says. connect() and configure() talk to the board and may take a second, at
/// most seven where none answers. start() never waits: a thread of the device's own asks for the
/// board's time, starts it, reads, and after `gone` opens and sets it again until it is back. A
/// board that says nothing for kSilent is gone. One that begins again (another boot_id) is
/// configured and started by itself, the pulses of another `boot` follow. A board that kept its
/// pulses going while the line was away goes on with them.
/// Time     Pulses are mapped: by pings, kFirstPings of them before the board starts, then every
///          Options::ping_interval. Where it answers none, they come unmapped.
/// Memory   The thread allocates only while the board is gone or begins again.
class Device final : public TriggerDevice,
                     private SerialDevice<Pulse, 256>,  // pulses: eight seconds at 30 Hz
                     private FrameSink {
 public:
  static constexpr Duration kSilent = Duration::seconds(1);
  static constexpr int kFirstPings = 8;
  static constexpr int kMostRefused =
      8;  // events in a row that make no sense: the board is set up anew

  Device(std::unique_ptr<LinePlace> place, const Options& options);
  ~Device() override;

  /// Opens the line and asks who is there. → ok, not_found (another make, or nobody),
  /// no_permission, busy, unsupported (another protocol version), gone, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] DeviceStatus configure(const TriggerConfiguration& requested,
                                       TriggerConfiguration* actual) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override { return timing_; }
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept override;
  [[nodiscard]] DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override;
  [[nodiscard]] DeviceStatus pause(std::uint32_t pulses) noexcept override;
  void stop() noexcept override;
  bool observe_bytes(ByteObserver* observer) noexcept override {
    set_byte_observer(observer);
    return true;
  }
  [[nodiscard]] std::string last_error() const override;
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] TriggerStatistics statistics() const noexcept override;

  /// Who the board said it is. Precondition: connected.
  [[nodiscard]] const TriggerInfo& identity() const noexcept { return identity_; }
  /// Any thread; at most a tenth of a second old.
  [[nodiscard]] BoardStatistics board_statistics() const noexcept;

 private:
  struct AskedPause {
    std::uint32_t pulses = 0;  // 0: none is waiting for its answer
    std::uint8_t sequence = 0;
    int turns = 0;
    HostStamp again{};
  };
  enum class Seen : std::uint8_t {
    nothing,
    reboot,
    halted,
    nonsense
  };  // what makes the thread stop reading and set the board up

  [[nodiscard]] DeviceStatus open();
  [[nodiscard]] DeviceStatus meet(TriggerInfo* who);
  [[nodiscard]] DeviceStatus set_up();
  [[nodiscard]] DeviceStatus refuse(DeviceStatus status, std::string sentence);
  [[nodiscard]] Duration byte_time() const noexcept;

  [[nodiscard]] DeviceStatus begin() noexcept override;
  [[nodiscard]] DeviceStatus begin_on(Setup* setup);
  [[nodiscard]] DeviceStatus started() noexcept;
  [[nodiscard]] DeviceStatus tie_clocks() noexcept;
  [[nodiscard]] DeviceStatus read_on() noexcept override;
  [[nodiscard]] DeviceStatus reopen() override;
  void interrupted(DeviceStatus status) noexcept override;
  void finished() noexcept override;
  [[nodiscard]] DeviceStatus read_one(HostStamp deadline) noexcept;
  void halt_board() noexcept;
  [[nodiscard]] std::uint32_t open_reports() const noexcept;
  void ping() noexcept;
  void send_pause(HostStamp now) noexcept;
  void accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept override;
  void take_event(const TriggerEvent& event, HostStamp arrival) noexcept;
  void take_pong(const TriggerPong& pong, HostStamp departure) noexcept;
  void take_status(const TriggerStatus& status) noexcept;
  [[nodiscard]] bool same_boot(std::uint32_t boot) noexcept;
  void publish(bool last) noexcept;
  void go_streaming(HostStamp now) noexcept;

  const Options options_;
  DeviceInfo info_;
  TriggerInfo identity_{};
  TriggerConfig config_{};
  std::uint32_t mark_ = 0;  // of config_, in STATUS
  std::uint32_t baud_ = 0;  // at which the board was last heard; 0: not yet
  bool connected_ = false, configured_ = false;
  DeviceTiming timing_{};
  std::string remark_;
  mutable std::mutex last_error_mutex_;
  std::string last_error_;

  // From here on: of the thread while it runs, else the owner's.
  BoardLine frames_;
  PulseAccount account_;
  BoardClock clock_;
  BoardStatistics counted_{};
  Random dither_{1, 63};
  AskedPause asked_pause_{};
  Seen seen_ = Seen::nothing;
  bool known_boot_ = false;  // account_.boot() is one
  bool running_ = false;     // it was started and makes pulses, as far as we know
  bool streaming_ = false;   // events go to the consumer
  HostStamp heard_{}, published_{};

  std::atomic<std::uint32_t> pause_{0};  // pulses that shall be left out and are not asked for yet
  mutable std::mutex published_mutex_;
  BoardStatistics published_statistics_{};
};

}  // namespace vergence::trigger_board
