#pragma once
#include <cstdint>
#include <string>

#include "drivers/camera.hpp"
#include "drivers/v4l2/controls.hpp"
#include "drivers/v4l2/formats.hpp"
#include "drivers/v4l2/node.hpp"

namespace vergence::v4l2 {

/// Settings applied to a camera.
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
/// → ok, unsupported, busy, disconnected, failed; not `ok`: *error, and the camera may be somewhere
/// in
///   between.
[[nodiscard]] DeviceStatus apply(int fd, std::uint32_t buffer_type, const Controls& controls,
                                 const CameraConfiguration& requested, const Options& options,
                                 Settings* settings, std::string* error);

/// The nearest exposure and gain that the camera has, also while it streams. *actual: what it took.
/// → ok, unsupported, disconnected, failed
[[nodiscard]] DeviceStatus change_exposure(const Controls& controls, const Settings& settings,
                                           const ExposureSetting& requested,
                                           ExposureSetting* actual) noexcept;

}  // namespace vergence::v4l2
