#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/calibration/monitor.hpp"
#include "core/calibration/options.hpp"
#include "core/odometry/options.hpp"
#include "core/types/calibration.hpp"
#include "drivers/camera.hpp"
#include "drivers/mock/world/kinds.hpp"
#include "drivers/options/options.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger_board/options.hpp"
#include "drivers/xsens/options.hpp"

namespace vergence::app {

/// `rig:` of the configuration.
struct RigSettings {
  std::string name{};  // of the rig, in the calibration.yaml that a session writes
  double baseline_m = 0.75;
  double focal_px = 0;  // 0: 0.72 of the image's width
  double k1 = 0, k2 = 0;
  std::string state_dir{};  // of the state file; empty: the user's folder for such things; `none`:
                            // no state file
};

/// Which part of a camera's picture an entry of `cameras:` is.
enum class ImageHalf : std::uint8_t { whole, left, right };

/// One entry of `cameras:`. Without a driver there is no such camera.
struct CameraSettings {
  std::string name{}, driver{}, serial{};
  ImageHalf half = ImageHalf::whole;
  int width = 640, height = 480;   // px, of this entry's image
  int offset_x = 0, offset_y = 0;  // px, of the region on the sensor
  std::string pixel_format{};
  CameraTrigger trigger = CameraTrigger::hardware;
  CameraOptions options{};  // of the driver
  double exposure_us = 8000;
  double trigger_delay_us = 0;  // from the pulse's edge to the exposure's start
  double stamp_jitter_us = 0;   // 0: what the driver's kind of stamp has
  double gain_db = 0;
  std::string mask{};  // file; empty: none
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  std::array<double, 4>
      intrinsics{};  // fx fy cx cy, px; zeros: those of rig.nominal, distortion included
  std::array<double, 5> distortion{};      // k1 k2 p1 p2 k3, or k1 to k4 of an equidistant lens
  std::array<double, 12> T_camera_left{};  // rows of [R t], m; zeros: as rig.nominal
};

/// `exposure:` of all cameras.
struct ExposureSettings {
  int mode = 0;  // 0: fixed, as cameras[] says; 1: auto
  double target = 90, saturated_percent = 5;
  double min_us = 20, max_us = 8000, max_gain_db = 18;
  int settle_frames = 5;
};

struct InsSettings {
  std::string driver = "none";
  std::string port{};      // empty: the only serial port on USB
  int baud = 0;            // 0: as the device has it
  double rate = 120;       // Hz
  double sync_out_hz = 0;  // 0: as the device has it; negative: off
  double sync_out_width_ms = 1;
  double processing_ms = 2;               // from a sample to its first byte on the line
  std::array<double, 3> lever_arm_m{};    // of the left camera in the INS's body: forward, left, up
  std::array<double, 3> boresight_deg{};  // roll, pitch, yaw
};

struct TriggerSettings {
  std::string driver = "none";
  std::string port{};  // empty: the only board there is
  int baud = 0;        // 0: found by asking
  double rate = 20;    // Hz
  double width_us = 200, dither_us = 0;
  int lines = 0;  // masks, bit k for line k; 0: one line for each camera
  int active_low = 0, feedback = 0, feedback_active_low = 0;
  trigger_board::Edge pps = trigger_board::Edge::none;  // of the GNSS receiver's pulse
  trigger_board::Edge ins = trigger_board::Edge::none;  // of the INS's SyncOut
};

struct SyncSettings {
  SyncMode mode = SyncMode::frame_counter;
  double timeout_ms = 100;
  double tolerance_ms = 2;
};

struct ComparisonSettings {
  double alignment_distance_m = 100;
  double correlation_s = 10;
  double heading_sigma_deg = 0;
  double max_gap_ms = 100;
  double max_wait_ms = 500;
  double jump_m = 20;
  double scale_tolerance = 0.02;
};

/// `kitti_raw:` which of its four cameras are taken.
struct KittiRawSettings {
  int left = 0, right = 1;
};

/// Sigmas of the errors in the intrinsics that the estimator receives.
struct IntrinsicsErrorSettings {
  double principal_point_px = 0, focal_percent = 0;
  std::int64_t seed = 1;
};

/// Errors of the stereo transform that the estimator receives: camera 1 as if it had been knocked,
/// then all lengths.
struct CalibrationErrorSettings {
  double pitch_deg = 0, yaw_deg = 0, roll_deg = 0;
  double x_m = 0, y_m = 0, z_m = 0;
  double length_percent = 0;
};

struct MockSettings {
  enum class Ins : std::uint8_t { noisy, ideal };

  std::string world = "suburb";
  vergence::mock::DriveKind drive = vergence::mock::DriveKind::loop;
  vergence::mock::Pattern pattern = vergence::mock::Pattern::grey;
  Ins ins = Ins::noisy;
  std::int64_t seed = 1;
  int texture_detail = 1;
  int noise = 1;
  int blur_samples = 1;
  double speed = 12, suspension = 1, vibration = 1, stop_s = 3, hill_deg = 3;
  double clock_drift_ppm = 30;
  IntrinsicsErrorSettings intrinsics_error{};
  CalibrationErrorSettings calibration_error{};
};

/// `record:` what goes into drive.mcap of a session (docs/session_files.md).
struct RecordSettings {
  int poses = 0, ins = 0, images = 0, pulses = 0;  // 1: recorded
  int split_mb = 0;                                // 0: one file

  [[nodiscard]] bool any() const noexcept { return poses + ins + images + pulses > 0; }
};

/// `publish:` what others see of a running session (docs/live_interface.md). Empty: nothing.
struct PublishSettings {
  std::string pose_stream{};  // unix:///PATH, udp://HOST:PORT
  std::string http{};         // HOST:PORT of the live page
  std::string token_file{};   // its first line; empty: a new token each session
};

/// `sessions:` the folders that drives leave side by side.
struct SessionsSettings {
  int quota_mb = 0;  // 0: none
};

/// `realtime:` scheduling of the drive's threads (docs/deployment.md).
struct RealtimeSettings {
  int priority = 0;        // SCHED_FIFO of the most urgent threads; 0: none
  std::string affinity{};  // processors of all but the solver, `0-1,3`; empty: any
  std::string solver_affinity{};
  int lock_memory = 0;         // 1: mlockall
  double frame_budget_ms = 0;  // of a live drive; 0: its frame interval
};

inline constexpr std::size_t kMaxFaults = 16;

/// Everything a user may change, with its defaults. Each member is bound to a row of the schema
/// (app/config/schema.hpp), which is where its unit, range and meaning stand.
struct Configuration {
  RigSettings rig{};
  std::array<CameraSettings, kMaxCameras> cameras{};
  ExposureSettings exposure{};
  InsSettings ins{};
  TriggerSettings trigger{};
  SyncSettings sync{};
  ComparisonSettings comparison{};
  KittiRawSettings kitti_raw{};
  MockSettings mock{};
  RecordSettings record{};
  PublishSettings publish{};
  SessionsSettings sessions{};
  RealtimeSettings realtime{};
  std::array<std::string, kMaxFaults> faults{};  // `KIND@SECONDS NAME=NUMBER …`; empty: none
  int preset = 0;  // odometry.preset: 1: small, what other keys are that nobody gave
  OdometryOptions odometry{};
  calibration::CalibrationOptions calibration{};
  int online = 1;  // calibration.online: 0: the calibration given is used for ever
  calibration::MonitorOptions monitor{};
  int threads = 2;                 // 1: both images on the estimator's thread
  std::filesystem::path folder{};  // of the file it was read from: where its files are looked for;
                                   // no key, empty without a file
};

/// Defaults, then the YAML file if one is given, then the `--set` arguments `KEY=VALUE` in order;
/// the last one wins.
///
/// KEY is dotted, with numbers for list items; VALUE is YAML (`0.4`, `text`, `[1, 2]`).
/// Errors  InputError with file:line (or the --set argument): unreadable file, unknown key (with
///         the nearest known one), a key that is given twice, wrong type, outside the range, values
///         that contradict each other.
[[nodiscard]] Configuration load_configuration(const std::optional<std::filesystem::path>& file,
                                               const std::vector<std::string>& set);

/// Parses a configuration from text; `name` replaces the file in error messages.
[[nodiscard]] Configuration parse_configuration(std::string_view yaml, const std::string& name,
                                                const std::vector<std::string>& set);

/// Keys that are not at their default, with their values, in the order of docs/configuration.md.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> changed_settings(
    const Configuration& configuration);

/// Every key and its value, one `key=value` a line, ordered by key, numbers in the shortest form
/// that reads back the same.
[[nodiscard]] std::string canonical_text(const Configuration& configuration);

/// 16 hexadecimal digits (FNV-1a, 64 bit) of canonical_text(): equal for equal configurations,
/// however they were written.
[[nodiscard]] std::string configuration_hash(const Configuration& configuration);

/// One option. Empty: done, or the driver has no options; else half a message about what is wrong.
[[nodiscard]] std::string set_camera_option(const std::string& name, const std::string& value,
                                            CameraSettings* camera);

/// All of them, `NAME=VALUE …`: those not named are as they begin. As set_camera_option().
[[nodiscard]] std::string set_camera_options(const std::string& text, CameraSettings* camera);

}  // namespace vergence::app
