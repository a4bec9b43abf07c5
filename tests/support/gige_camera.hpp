#pragma once
#include <condition_variable>
#include <deque>
#include <functional>

#include "tests/support/gvsp_sender.hpp"

namespace vergence::test {

/// Properties of a simulated camera.
struct GigeCameraOptions {
  /// Any of 127.0.0.0/8; one camera each.
  std::string address = "127.0.0.2";
  std::string serial = "SIM-1";
  /// px.
  int sensor_width = 1280, sensor_height = 960;
  /// Rate of its clock, Hz; 0: it has none.
  std::uint64_t tick_frequency = 125'000'000;
  /// Its clock at the host's 0.
  std::int64_t clock_offset_ns = 7'000'000'000'000;
  double clock_drift_ppm = 20;
  /// 16-bit ids wrap 35 frames later; 0 is never used.
  std::uint64_t first_block = 65'500;
  /// 64-bit block ids.
  bool extended_ids = false;
  /// ExposureTimeAbs, GainRaw, AcquisitionFrameRateAbs as cameras before SFNC 2.0.
  bool old_names = false;
  /// Answers broadcasts.
  bool discoverable = true;
  /// Seed of the packets that are lost.
  std::uint64_t seed = 1;
  /// The first 8 bytes of an image are its number, little endian.
  bool number_images = true;
  /// Pixels of image `number`, width × height bytes that stay valid; empty: a pattern of the
  /// simulator's own.
  std::function<const std::uint8_t*(std::uint64_t number)> images{};
};

/// A small GigE Vision camera on the loopback: GVCP control, GenICam description, GVSP stream, in
/// threads of its own.
///
/// Free running cameras expose at the multiples of their period of CLOCK_MONOTONIC, so that two of
/// one rate expose together.
/// Registers  Bootstrap registers of GigE Vision 1.2 and the few features of the description
///            (description()).
/// Threads    Any call from any thread. Errors  The constructor throws std::runtime_error: the
/// address is in use.
class GigeCamera {
  template <class Work>
  auto with_lock(const Work& work) const {
    const std::lock_guard lock(mutex_);
    return work();
  }

 public:
  explicit GigeCamera(const GigeCameraOptions& options);
  ~GigeCamera();
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;

  /// An address of the loopback that no other program's tests use at the same time; `k` below 250.
  [[nodiscard]] static std::string address(int k);

  /// Answers and sends nothing until replug(), after which no program has control.
  void unplug() { power(false); }
  void replug() { power(true); }
  /// While silent, the camera answers but exposes nothing.
  void silence(bool silent) {
    with_lock([&] { silent_ = silent; });
  }
  /// The next exposures are not sent at all.
  void lose_frames(int exposures) {
    with_lock([&] { lose_ += exposures; });
  }
  /// One data packet of each of the next exposures is never sent.
  void tear_frames(int exposures) {
    with_lock([&] { tear_ += exposures; });
  }
  /// Share of the packets that are lost, including those sent again.
  void set_loss(double share) { sender_.set_loss(share); }
  /// Sends images of this size instead of the registers'; 0 ends it.
  void lie_about_size(int width, int height) {
    with_lock([&] { lie_width_ = width, lie_height_ = height; });
  }
  /// A pulse at Line1 exposes image `number` once if the camera waits for a pulse. `when` is its
  /// time; 0 means now.
  void pulse(std::uint64_t number, HostStamp when = {});
  /// Another program takes control; false gives it back.
  void take_control(bool taken);

  [[nodiscard]] GigeCameraReport report() const;
  /// A bootstrap register or one of the features.
  [[nodiscard]] std::uint32_t read(std::uint32_t address) const {
    return with_lock([&] { return word(address); });
  }
  void write(std::uint32_t address, std::uint32_t value) {
    with_lock([&] { (void)store(address, value); });
  }
  /// The device clock in its ticks at a time of the host.
  [[nodiscard]] std::uint64_t ticks(HostStamp host) const;
  [[nodiscard]] bool acquiring() const {
    return with_lock([&] { return acquiring_; });
  }
  [[nodiscard]] const GigeCameraOptions& options() const { return options_; }

 private:
  void power(bool on);
  void answer();
  void handle(int fd, const std::uint8_t* bytes, std::size_t length, const sockaddr_in& from);
  std::uint32_t write_registers(const std::uint8_t* payload, std::uint32_t length,
                                const sockaddr_in& from);
  std::uint32_t store(std::uint32_t address, std::uint32_t value);
  [[nodiscard]] bool value_fits(std::uint32_t address, std::uint32_t value) const;
  void expose();
  GvspFrame make_frame(std::uint64_t number, HostStamp when);
  void follow_registers();
  [[nodiscard]] bool may_write(const sockaddr_in& from, std::uint32_t address) const;
  [[nodiscard]] std::uint32_t word(std::uint32_t address) const;
  [[nodiscard]] float real(std::uint32_t address) const;
  [[nodiscard]] std::uint32_t payload() const;
  void put(std::uint32_t address, std::uint32_t value);
  void put_text(std::uint32_t address, const std::string& text, std::size_t room);
  void reset();

  const GigeCameraOptions options_;
  GvspSender sender_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool silent_ = false;
  int lose_ = 0, tear_ = 0, lie_width_ = 0, lie_height_ = 0;
  std::uint64_t starts_ = 0;
  std::vector<std::uint8_t> memory_;
  HostStamp born_{};
  int control_ = -1, broadcast_ = -1, wake_ = -1;
  bool quit_ = false, powered_ = true, acquiring_ = false, foreign_ = false;
  sockaddr_in controller_{};
  /// Time of the controller's last message.
  HostStamp heard_{};
  /// Triggers that are not served yet: number of the image and time.
  std::deque<std::pair<std::uint64_t, HostStamp>> pulses_;
  /// Number of software triggers.
  std::uint64_t triggered_ = 0;
  std::uint64_t block_ = 0;
  std::thread answering_, exposing_;
};

/// Addresses of the features' registers.
namespace gige_register {
inline constexpr std::uint32_t width = 0x10000, height = 0x10004, offset_x = 0x10008,
                               offset_y = 0x1000C, pixel_format = 0x10010,
                               acquisition_start = 0x10014, acquisition_stop = 0x10018,
                               acquisition_mode = 0x1001C, frame_rate_enable = 0x10020,
                               frame_rate = 0x10024, exposure_time = 0x10028, gain = 0x1002C,
                               trigger_selector = 0x10030, trigger_mode = 0x10034,
                               trigger_source = 0x10038, trigger_activation = 0x1003C,
                               trigger_overlap = 0x10040, trigger_delay = 0x10044,
                               trigger_software = 0x10048, exposure_mode = 0x1004C,
                               exposure_auto = 0x10050, gain_auto = 0x10054, payload_size = 0x10058,
                               locked = 0x1005C, ptp_enable = 0x10060, ptp_status = 0x10064,
                               gain_raw = 0x10068, sensor_width = 0x1006C, sensor_height = 0x10070,
                               line_selector = 0x10074, line_mode = 0x10078, line_source = 0x1007C,
                               chunk_mode = 0x10080;
}  // namespace gige_register

/// The GenICam description of such a camera.
[[nodiscard]] std::string gige_description(const GigeCameraOptions& options);

}  // namespace vergence::test
