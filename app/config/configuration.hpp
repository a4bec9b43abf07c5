#pragma once
#include <filesystem>

#include "app/runtime/realtime.hpp"
#include "core/calibration/monitor.hpp"
#include "core/calibration/options.hpp"
#include "core/odometry/options.hpp"
#include "drivers/camera.hpp"
#include "drivers/mock/world/kinds.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger_board/options.hpp"
#include "drivers/xsens/options.hpp"

namespace vergence::app {

/// The group `rig` of the configuration.
struct RigSettings {
  /// Name of the rig in the calibration.yaml that a session writes.
  std::string name{};
  double baseline_m = 0.75;
  /// Nominal focal length in px; 0: 0.72 of the image width.
  double focal_px = 0;
  double k1 = 0, k2 = 0;
  /// Directory of the state file; empty: the user's state directory; `none`: no state file.
  std::string state_dir{};
};

/// Part of a camera's image used by an entry of `cameras`.
enum class ImageHalf : std::uint8_t { whole, left, right };

/// Entry of `cameras`. Without a driver the camera does not exist.
struct CameraSettings {
  std::string name{}, driver{}, serial{};
  ImageHalf half = ImageHalf::whole;
  /// Size of this entry's image, px.
  int width = 640, height = 480;
  /// Offset of the region of interest on the sensor, px.
  int offset_x = 0, offset_y = 0;
  std::string pixel_format{};
  CameraTrigger trigger = CameraTrigger::hardware;
  /// Options of the driver.
  CameraOptions options{};
  double exposure_us = 8000;
  /// Delay from the pulse's edge to the start of the exposure.
  double trigger_delay_us = 0;
  /// Jitter of the camera's stamps; 0: the default of the driver.
  double stamp_jitter_us = 0;
  double gain_db = 0;
  /// Image file of the mask; empty: no mask.
  std::string mask{};
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  /// fx fy cx cy in px; zeros: those of rig.nominal, with its distortion.
  std::array<double, 4> intrinsics{};
  /// k1 k2 p1 p2 k3, or k1 to k4 of an equidistant lens.
  std::array<double, 5> distortion{};
  /// Rows of [R t], in m; zeros: those of rig.nominal.
  std::array<double, 12> T_camera_left{};
};

/// Exposure of all cameras.
struct ExposureSettings {
  /// 0: fixed, as configured in cameras[]; 1: automatic.
  int mode = 0;
  double target = 90, saturated_percent = 5;
  double min_us = 20, max_us = 8000, max_gain_db = 18;
  int settle_frames = 5;
};

struct InsSettings {
  std::string driver = "none";
  /// Serial port; empty: the only one on USB.
  std::string port{};
  /// Baud rate; 0: the device's own.
  int baud = 0;
  /// In Hz.
  double rate = 120;
  /// Rate of SyncOut; 0: the device's own; negative: off.
  double sync_out_hz = 0;
  double sync_out_width_ms = 1;
  /// Delay from a sample to its first byte on the serial link.
  double processing_ms = 2;
  /// Position of the left camera in the INS's body frame: forward, left, up.
  std::array<double, 3> lever_arm_m{};
  /// Roll, pitch and yaw of the camera relative to the INS.
  std::array<double, 3> boresight_deg{};
};

struct TriggerSettings {
  std::string driver = "none";
  /// Serial port of the trigger board; empty: the only board.
  std::string port{};
  /// Baud rate; 0: detected.
  int baud = 0;
  /// In Hz.
  double rate = 20;
  double width_us = 200, dither_us = 0;
  /// Masks with bit k for line k; 0: one line per camera.
  int lines = 0;
  int active_low = 0, feedback = 0, feedback_active_low = 0;
  /// Edge of the GNSS receiver's pulse per second.
  trigger_board::Edge pps = trigger_board::Edge::none;
  /// Edge of the INS's SyncOut.
  trigger_board::Edge ins = trigger_board::Edge::none;
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
};

/// Selection of the four cameras of a KITTI raw sequence.
struct KittiRawSettings {
  int left = 0, right = 1;
};

/// Simulated standard deviations of the errors in the estimator's intrinsics.
struct IntrinsicsErrorSettings {
  double principal_point_px = 0, focal_percent = 0;
  std::int64_t seed = 1;
};

/// Simulated errors in the estimator's stereo transform: camera 1 is moved as by a knock, then all
/// lengths are scaled.
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

/// Topics in drive.mcap of a session (docs/session_files.md).
struct RecordSettings {
  /// 1 records the topic.
  int poses = 0, ins = 0, images = 0, pulses = 0;
  /// Size of a file after which a new one starts; 0: a single file.
  int split_mb = 0;

  [[nodiscard]] bool any() const noexcept { return poses + ins + images + pulses > 0; }
};

/// Interfaces of a running session (docs/live_interface.md). Empty values disable them.
struct PublishSettings {
  /// unix:///PATH or udp://HOST:PORT.
  std::string pose_stream{};
  /// HOST:PORT of the live page.
  std::string http{};
  /// File whose first line is the token; empty: a new token per session.
  std::string token_file{};
};

/// `sessions:` the folders that drives leave side by side.
struct SessionsSettings {
  /// Quota of the parent directory; 0: none.
  int quota_mb = 0;
};

inline constexpr std::size_t kMaxFaults = 16;

/// All user settings with their defaults. Each member is bound to a row of the schema
/// (app/config/schema.hpp), which has its unit, range and meaning.
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
  /// `KIND@SECONDS NAME=NUMBER …`; empty: none.
  std::array<std::string, kMaxFaults> faults{};
  /// odometry.preset; 1: small, other defaults of keys that are not set.
  int preset = 0;
  OdometryOptions odometry{};
  calibration::CalibrationOptions calibration{};
  /// calibration.online; 0: the initial calibration is used throughout.
  int online = 1;
  calibration::MonitorOptions monitor{};
  /// 1: both images are processed on the estimator's thread.
  int threads = 2;
  /// Directory of the configuration file, which relative paths refer to; no key, empty without a
  /// file.
  std::filesystem::path folder{};
};

/// Loads the defaults, then the YAML file if given, then the `--set` arguments `KEY=VALUE` in
/// order; the last one takes precedence.
///
/// KEY is dotted, with numbers for list items; VALUE is YAML (`0.4`, `text`, `[1, 2]`). Throws
/// InputError with file:line (or the --set argument): unreadable file, unknown key (with the
/// nearest known one), duplicate key, wrong type, out of range, contradicting values.
[[nodiscard]] Configuration load_configuration(const std::optional<std::filesystem::path>& file,
                                               const std::vector<std::string>& set);

/// Parses a configuration from text; `name` replaces the file in error messages.
[[nodiscard]] Configuration parse_configuration(std::string_view yaml, const std::string& name,
                                                const std::vector<std::string>& set);

/// Keys that differ from their defaults, with their values, in the order of docs/configuration.md.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> changed_settings(
    const Configuration& configuration);

/// Every key and its value, one `key=value` per line, ordered by key, with numbers in their
/// shortest exact form.
[[nodiscard]] std::string canonical_text(const Configuration& configuration);

/// 16 hexadecimal digits (FNV-1a, 64 bit) of canonical_text(), equal for equal configurations.
[[nodiscard]] std::string configuration_hash(const Configuration& configuration);

/// Sets all options from `NAME=VALUE …`; the others get the driver's defaults. Throws InputError
/// with a message about the option; without a driver there are none.
void set_camera_options(const std::string& text, CameraSettings* camera);

}  // namespace vergence::app
