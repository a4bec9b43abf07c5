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
  /// Distance between two rows, in bytes.
  std::size_t stride = 0;
  /// Size of a buffer, in bytes.
  std::size_t image_size = 0;
  Duration readout{};
  /// Ids of the controls; 0 if the camera has none whose unit is known.
  std::uint32_t exposure_id = 0, gain_id = 0;
  double exposure_unit_s = 0, gain_unit_db = 0;
  /// Exposure rate, in Hz; with `thin` higher than actual.rate_hz. 0 if unknown.
  double camera_rate_hz = 0;
  std::string remark;
};

/// Configures an open camera: format, region, rate, exposure, gain, trigger and other controls. If
/// not `ok`, *error has the reason and the camera may be partly configured. → ok, unsupported,
/// busy, disconnected, failed
[[nodiscard]] DeviceStatus apply(int fd, std::uint32_t buffer_type, const Controls& controls,
                                 const CameraConfiguration& requested, const Options& options,
                                 Settings* settings, std::string* error);

/// Applies the nearest supported exposure and gain, also while streaming. *actual receives the
/// applied values. → ok, unsupported, disconnected, failed
[[nodiscard]] DeviceStatus change_exposure(const Controls& controls, const Settings& settings,
                                           const ExposureSetting& requested,
                                           ExposureSetting* actual) noexcept;

}  // namespace vergence::v4l2
