#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/v4l2/controls.hpp"
#include "drivers/v4l2/formats.hpp"
#include "drivers/v4l2/node.hpp"

namespace vergence::v4l2 {

/// CameraConfiguration::options in their own types.
struct Options {
  Duration readout =
      Duration::nanoseconds(-1);  // negative: from the sensor's own figures, else zero
  int shift = -1;  // bits below the eight that are kept, of 16-bit formats; negative: by the format
  int thin = 1;    // the camera runs at so many times the rate, one image in each interval is kept
  int buffers = 16;
  std::string subdevice;        // node with the sensor's controls
  std::string trigger_control;  // key; "external": switched outside (module parameter, device tree)
  std::string trigger_value;
  double gain_step_db = 0;  // of the camera's gain control; 0: not known
  std::vector<std::pair<std::string, std::string>> controls;
};

/// False: *error says which option is wrong and what there is.
[[nodiscard]] bool parse_options(const CameraConfiguration& requested, Options* options,
                                 std::string* error);
/// What is wrong with the numbers by themselves; empty: nothing.
[[nodiscard]] std::string find_nonsense(const CameraConfiguration& requested);

/// What a camera has been brought to.
struct Settings {
  CameraConfiguration actual{};
  Options options{};
  PixelFormat format{};
  std::size_t stride = 0;      // bytes from a row to the next
  std::size_t image_size = 0;  // bytes of a buffer
  Duration readout{};
  std::uint32_t exposure_id = 0,
                gain_id = 0;  // controls; 0: the camera has none that could be set in units
  double exposure_unit_s = 0, gain_unit_db = 0;
  double camera_rate_hz =
      0;  // of the exposures; with `thin` more than actual.rate_hz. 0: not known
  std::string remark;
};

/// Brings an open camera to a configuration: format, region, rate, exposure, gain, trigger, other
/// controls.
///
/// → ok, unsupported, busy, gone, failed; not `ok`: *error, and the camera may be somewhere in
///   between.
[[nodiscard]] DeviceStatus apply(int fd, std::uint32_t buffer_type, const Controls& controls,
                                 const CameraConfiguration& requested, const Options& options,
                                 Settings* settings, std::string* error);

/// The nearest exposure and gain that the camera has, also while it streams. *actual: what it took.
/// → ok, unsupported, gone, failed
[[nodiscard]] DeviceStatus change_exposure(const Controls& controls, const Settings& settings,
                                           const ExposureSetting& requested,
                                           ExposureSetting* actual) noexcept;

}  // namespace vergence::v4l2
