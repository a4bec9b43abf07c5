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

/// One that is open and configured.
struct OpenedCamera {
  std::unique_ptr<CameraDevice> device;
  CameraConfiguration actual;
};

/// Opens and configures the cameras of a configuration in order. An empty serial takes the next
/// camera that no other entry names. A left half and a right one with the same driver and serial
/// are one camera.
///
/// Errors  As refuse_device(), one message: the key, what was found or what the camera offers,
///         what to do. Nothing stays open then.
/// `remarks`: messages about what works, but not as well as it should.
[[nodiscard]] std::vector<OpenedCamera> open_cameras(const Configuration& configuration,
                                                     std::vector<std::string>* remarks);

/// The key of a camera's entry: `cameras.0`.
[[nodiscard]] std::string camera_key(std::size_t k);
/// A camera for a message: `cameras.0 (gige 15021234)`.
[[nodiscard]] std::string camera_title(const std::string& key, const DeviceInfo& info);

}  // namespace vergence::app
