#pragma once
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/ins.hpp"
#include "drivers/serial/byte_line.hpp"
#include "drivers/stream.hpp"
#include "drivers/xsens/decoder.hpp"
#include "drivers/xsens/setup.hpp"

namespace vergence::xsens {

/// An XSens MTi-G or MTi-G-700/710 on a serial line.
///
/// As InsDevice says. configure() finds the device (baud scan), sets what differs, and may take
/// seconds; so the owner calls it before the drive. start() never waits: a thread of the device's
/// own puts it into measurement, reads, and after `gone` opens and sets it again until it is back.
/// A silent device (kSilent) is one that is gone.
/// Time  Readings are mapped: `host` and `host_error` are set (decoder.hpp).
class Device final : public InsDevice {
 public:
  static constexpr Duration kSilent = Duration::seconds(2);

  Device(std::unique_ptr<LinePlace> place, const Options& options);
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() override;

  /// Opens the line, finds the device and asks who it is; leaves it in its configuration state. →
  /// ok, not_found, no_permission, busy, unsupported (another make), gone, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override;
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept override;
  [[nodiscard]] DeviceStatus wait(Duration limit, InsReading* reading) noexcept override;
  void stop() noexcept override;
  [[nodiscard]] std::string last_error() const override { return last_error_; }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] bool keeps_own_time() const noexcept override { return virtual_time_; }
  [[nodiscard]] InsStatistics statistics() const noexcept override;

  [[nodiscard]] const Identity& identity() const noexcept { return identity_; }
  [[nodiscard]] const StreamSettings& stream() const noexcept { return set_; }

 private:
  static constexpr std::size_t kRing = 1024;  // readings: 2.5 s at 400 Hz
  using Item = Delivery<InsReading>;

  [[nodiscard]] DeviceStatus open();
  [[nodiscard]] DeviceStatus bring_up();
  [[nodiscard]] std::string remark_about(double rate_hz) const;
  void work() noexcept;
  [[nodiscard]] DeviceStatus measure() noexcept;
  [[nodiscard]] DeviceStatus read_on() noexcept;
  [[nodiscard]] bool come_back() noexcept;
  void hand_out(const Item& item, bool always) noexcept;
  void count() noexcept;
  void close_line() noexcept;
  void pause(Duration time) noexcept;

  std::unique_ptr<LinePlace> place_;
  const Options options_;
  DeviceInfo info_;
  Identity identity_{};
  StreamSettings set_{};
  double rate_hz_ = 0;
  std::uint32_t baud_ = 0;  // at which the device was last heard; 0: not yet
  bool configured_ = false, virtual_time_ = false;
  std::string last_error_, remark_;

  std::mutex line_mutex_;  // of the pointer: stop() wakes a line that the thread may be replacing
  std::unique_ptr<ByteLine> line_;  // of the thread while it runs, else the owner's
  Decoder decoder_;                 // the same
  vergence::Stream<InsReading, kRing> out_;
  std::atomic<bool> stopping_{false};
  std::mutex pause_mutex_;
  std::condition_variable stopped_;
  std::thread thread_;
  std::atomic<std::uint64_t> delivered_{0}, lost_{0}, malformed_{0}, overruns_{0}, starts_{0},
      restarts_{0};
};

}  // namespace vergence::xsens
