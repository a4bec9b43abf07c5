#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "drivers/camera.hpp"

namespace vergence::app {

/// A kind of camera that a configuration can name.
struct CameraDriverRow {
  const char* name;     // of `cameras[].driver`
  const char* meaning;  // for lists
  std::unique_ptr<CameraDriver> (*make)();
  const char* permission;  // what to do where the system does not let us
};

/// The table of drivers for real cameras: everything that talks to one is chosen here. The mock's
/// cameras come from its rig.
[[nodiscard]] const std::vector<CameraDriverRow>& camera_driver_rows();
[[nodiscard]] std::vector<std::string> camera_driver_names();

/// One camera as configured.
struct CameraRequest {
  std::string key;  // `cameras.0`, for messages
  std::string driver, serial;
  ImageHalf half = ImageHalf::whole;
  CameraConfiguration configuration;  // `sharing` is filled in: the requests with the same driver
};

/// One that is open and configured.
struct OpenedCamera {
  std::unique_ptr<CameraDevice> device;
  CameraConfiguration actual;
};

/// Opens and configures them in order. An empty serial takes the next camera that no other request
/// names. A left half and a right one with the same driver and serial are one camera.
///
/// Errors  As refuse_device(), one message: the key, what was found or what the camera offers,
///         what to do. Nothing stays open then.
/// `remarks`: messages about what works, but not as well as it should.
[[nodiscard]] std::vector<OpenedCamera> open_cameras(const std::vector<CameraRequest>& requests,
                                                     std::vector<std::string>* remarks);

/// A camera for a message: `cameras.0 (gige 15021234)`.
[[nodiscard]] std::string camera_title(const std::string& key, const DeviceInfo& info);

}  // namespace vergence::app
