#pragma once
#include <memory>

#include "app/config/configuration.hpp"

namespace vergence::app {

/// Kind of camera that a configuration can name.
struct CameraDriverRow {
  /// Value of `cameras[].driver`.
  const char* name;
  /// Description for lists.
  const char* meaning;
  std::unique_ptr<CameraDriver> (*make)();
  /// Fix for missing permissions.
  const char* permission;
};

/// Table of drivers for real cameras, which selects all code that accesses them. Simulated cameras
/// come from the mock's rig.
[[nodiscard]] const std::vector<CameraDriverRow>& camera_driver_rows();

/// Open and configured camera.
struct OpenedCamera {
  std::unique_ptr<CameraDevice> device;
  CameraConfiguration actual{};
};

/// Opens and configures the cameras of a configuration in order. An empty serial takes the next
/// camera that no other entry names. A left and a right half with the same driver and serial are
/// one camera.
///
/// On failure throws as refuse_device(), with the key, what was found or is supported, and the fix;
/// nothing stays open. `remarks` receives messages about limitations.
[[nodiscard]] std::vector<OpenedCamera> open_cameras(const Configuration& configuration,
                                                     std::vector<std::string>* remarks);

/// Key of a camera's entry, such as `cameras.0`.
[[nodiscard]] std::string camera_key(std::size_t k);
/// Camera in messages, such as `cameras.0 (gige 15021234)`.
[[nodiscard]] std::string camera_title(const std::string& key, const DeviceInfo& info);

}  // namespace vergence::app
