#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/types/time.hpp"

namespace vergence::test {

/// Properties of a simulated camera.
struct GigeCameraOptions {
  std::string address = "127.0.0.2";  // any of 127.0.0.0/8; one camera each
  std::string serial = "SIM-1";
  int sensor_width = 1280, sensor_height = 960;      // px
  std::uint64_t tick_frequency = 125'000'000;        // Hz of its clock; 0: it has none
  std::int64_t clock_offset_ns = 7'000'000'000'000;  // its clock at the host's 0
  double clock_drift_ppm = 20;
  std::uint64_t first_block = 65'500;  // 16-bit ids wrap 35 frames later; 0 is never used
  bool extended_ids = false;           // 64-bit block ids
  bool old_names =
      false;  // ExposureTimeAbs, GainRaw, AcquisitionFrameRateAbs as cameras before SFNC 2.0
  bool discoverable = true;   // answers broadcasts
  std::uint64_t seed = 1;     // of the packets that are lost
  bool number_images = true;  // the first 8 bytes of an image are its number, little endian
  /// Pixels of image `number`, width × height bytes that stay valid; empty: a pattern of the
  /// simulator's own.
  std::function<const std::uint8_t*(std::uint64_t number)> images{};
};

/// Exact counts of its exposures. A frame is one exposure since the acquisition's start.
struct GigeCameraReport {
  std::uint64_t exposed = 0;   // frames
  std::uint64_t whole = 0;     // every packet was sent, at first or when asked again
  std::uint64_t torn = 0;      // the leader was sent, something else was not
  std::uint64_t headless = 0;  // the leader was not sent, something else was
  std::uint64_t nothing = 0;   // not one packet was sent
  std::uint64_t dropped = 0;   // packets, at first
  std::uint64_t asked = 0;     // packets asked for again
  std::uint64_t resent = 0;    // of these sent
  std::uint64_t starts = 0;    // acquisitions
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
 public:
  explicit GigeCamera(const GigeCameraOptions& options);
  ~GigeCamera();

  /// An address of the loopback that no other program's tests use at the same time; `k` below 250.
  [[nodiscard]] static std::string address(int k);

  void unplug();  // Answers and sends nothing until replug(), after which no program has control.
  void replug();
  void silence(bool silent);        // answers, exposes nothing
  void lose_frames(int exposures);  // the next ones are not sent at all
  void tear_frames(
      int exposures);  // of the next ones one packet of data is not sent and not sent again
  void set_loss(double share);  // of the packets, those sent again too
  void lie_about_size(
      int width,
      int height);  // Sends images of this size instead of the registers'; 0: theirs again.
  /// A pulse at Line1: one exposure of image `number` where the camera waits for one. `when`: its
  /// time; 0: now.
  void pulse(std::uint64_t number, HostStamp when = {});
  /// Somebody else takes control, as another program would; false gives it back.
  void take_control(bool taken);

  [[nodiscard]] GigeCameraReport report() const;
  /// A bootstrap register or one of the features.
  [[nodiscard]] std::uint32_t read(std::uint32_t address) const;
  void write(std::uint32_t address, std::uint32_t value);
  /// The device clock at a time of the host's, in its ticks.
  [[nodiscard]] std::uint64_t ticks(HostStamp host) const;
  [[nodiscard]] bool acquiring() const;
  [[nodiscard]] const GigeCameraOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
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
