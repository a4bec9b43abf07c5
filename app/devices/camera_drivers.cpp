#include "app/devices/camera_drivers.hpp"

#include <algorithm>

#include "app/devices/rig_settings.hpp"
#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/common/side_by_side_camera.hpp"
#include "drivers/gige/gige.hpp"
#include "drivers/iidc/iidc.hpp"
#include "drivers/v4l2/v4l2.hpp"

namespace vergence::app {
namespace {

/// The schema has checked the name.
const CameraDriverRow& find_row(const std::string& driver) {
  const auto& rows = camera_driver_rows();
  return *std::ranges::find_if(rows,
                               [&](const CameraDriverRow& row) { return driver == row.name; });
}

std::string format_list(const std::vector<DeviceInfo>& found) {
  if (found.empty()) return "none found";
  std::string text = "found:";
  for (const DeviceInfo& d : found)
    text += fmt::format("{} {} ({}, {})", &d == found.data() ? "" : ",",
                        d.serial.empty() ? "without a serial" : d.serial, d.model, d.place);
  return text;
}

/// The message for an open() that gave nothing.
std::string refusal(const std::string& key, const std::string& serial, const CameraDriverRow& row,
                    CameraDriver& driver, DeviceStatus status) {
  const std::string who = fmt::format("{}: the {} camera {}", key, row.name,
                                      serial.empty() ? "" : "\"" + serial + "\" ");
  std::string error = driver.last_error();
  switch (status) {
    case DeviceStatus::not_found:
      return fmt::format("{}was not found ({}); check cable, power and {}.serial{}", who,
                         format_list(driver.enumerate()), key, error.empty() ? "" : ": " + error);
    case DeviceStatus::busy:
      return fmt::format("{}is in use by another program; end that program{}", who,
                         error.empty() ? "" : ": " + error);
    case DeviceStatus::no_permission:
      return fmt::format("{}cannot be opened: permission denied; {}", who,
                         error.empty() ? row.permission : error);
    default:
      return fmt::format("{}cannot be opened: {}", who,
                         error.empty() ? std::string(to_string(status)) : error);
  }
}

bool are_one_camera(const CameraSettings& a, const CameraSettings& b) {
  return a.half != ImageHalf::whole && b.half != ImageHalf::whole && a.half != b.half &&
         a.driver == b.driver && a.serial == b.serial;
}

/// A half needs its other one, asked for in the same way.
void check_half(const Configuration& c, std::size_t k) {
  const CameraSettings& camera = c.cameras[k];
  if (camera.half == ImageHalf::whole) return;
  const auto other = std::ranges::find_if(
      c.cameras, [&](const CameraSettings& s) { return are_one_camera(s, camera); });
  const bool left = camera.half == ImageHalf::left;
  if (other == c.cameras.end())
    throw InputError(
        "{}.image_half is {}, but no other entry is the {} half of the same frame; add one with "
        "the same driver and serial, and image_half: {}",
        camera_key(k), left ? "left" : "right", left ? "right" : "left", left ? "right" : "left");
  const auto j = static_cast<std::size_t>(other - c.cameras.begin());
  const CameraConfiguration a = camera_configuration(c, k), b = camera_configuration(c, j);
  if (a.exposure != b.exposure || a.gain_db != b.gain_db || a.pixel_format != b.pixel_format ||
      a.offset_x != b.offset_x || a.offset_y != b.offset_y ||
      options_text(a.options) != options_text(b.options))
    throw InputError(
        "{} and {} are halves of one camera's frame, but their settings differ; set exposure_us, "
        "gain_db, pixel_format, offset and options equally",
        camera_key(k), camera_key(j));
}

/// The drivers in use and the cameras already opened.
class Openings {
 public:
  explicit Openings(const Configuration& c) : configuration_(c) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(camera_count(c)); ++k) {
      const CameraSettings& camera = c.cameras[k];
      check_half(c, k);
      // The left half represents the camera.
      if (camera.half == ImageHalf::right) continue;
      ++sharing_[camera.driver];
      if (!camera.serial.empty()) reserved_.emplace_back(camera.driver, camera.serial);
    }
    for (const auto& [name, serial] : reserved_)
      if (std::ranges::count(reserved_, std::pair(name, serial)) > 1)
        throw InputError(
            "two entries of cameras have the serial \"{}\"; set the serial of the second camera",
            serial);
  }

  OpenedCamera open(std::size_t k) {
    const CameraSettings& camera = configuration_.cameras[k];
    OpenedCamera opened{.device = camera.half == ImageHalf::whole ? open_device(k) : open_half(k)};
    CameraConfiguration requested = camera_configuration(configuration_, k);
    requested.sharing = sharing_[camera.driver];
    const DeviceStatus status = opened.device->configure(requested, &opened.actual);
    require_configured(camera_title(camera_key(k), opened.device->info()), status,
                       opened.device->last_error());
    return opened;
  }

 private:
  struct OpenHalf {
    const CameraSettings* of;
    std::unique_ptr<CameraDevice> device;
  };

  /// The camera behind two entries is opened with the first of them.
  std::unique_ptr<CameraDevice> open_half(std::size_t k) {
    const CameraSettings& camera = configuration_.cameras[k];
    for (OpenHalf& h : halves_)
      if (are_one_camera(*h.of, camera) && h.device != nullptr) return std::move(h.device);
    auto [left, right] = split_side_by_side(open_device(k));
    const bool is_left = camera.half == ImageHalf::left;
    halves_.push_back({&camera, is_left ? std::move(right) : std::move(left)});
    return is_left ? std::move(left) : std::move(right);
  }

  std::unique_ptr<CameraDevice> open_device(std::size_t k) {
    const CameraDriverRow& row = find_row(configuration_.cameras[k].driver);
    std::unique_ptr<CameraDriver>& driver = drivers_[row.name];
    if (driver == nullptr) driver = row.make();
    std::string serial = configuration_.cameras[k].serial;
    if (serial.empty()) serial = next(k, *driver);
    DeviceStatus status = DeviceStatus::ok;
    auto device = driver->open(serial, &status);
    if (device == nullptr)
      refuse_device(status, refusal(camera_key(k), serial, row, *driver, status));
    return device;
  }

  /// The serial of the next camera that no entry has or names.
  std::string next(std::size_t k, CameraDriver& driver) {
    const std::string& name = configuration_.cameras[k].driver;
    const std::vector<DeviceInfo> found = driver.enumerate();
    for (const DeviceInfo& d : found) {
      const std::pair who(name, d.serial);
      if (std::ranges::find(reserved_, who) != reserved_.end()) continue;
      reserved_.push_back(who);
      return d.serial;
    }
    const std::string error = driver.last_error();
    throw DeviceError(fmt::format("{}: no {} camera is available ({}); check cable and power{}",
                                  camera_key(k), name, format_list(found),
                                  error.empty() ? "" : ": " + error));
  }

  const Configuration& configuration_;
  std::map<std::string, std::unique_ptr<CameraDriver>> drivers_;
  std::map<std::string, int> sharing_;
  // Halves that were opened together with the other half and are not requested yet.
  std::vector<OpenHalf> halves_;
  // Pairs of driver and serial number.
  std::vector<std::pair<std::string, std::string>> reserved_;
};

}  // namespace

const std::vector<CameraDriverRow>& camera_driver_rows() {
  // One row a driver: {name, meaning, its make_driver, what to do without permission}.
  static const std::vector<CameraDriverRow> rows{
      {"gige", "GigE Vision cameras", gige::make_driver, "run `vergence doctor`"},
      {"iidc-usb", "IIDC cameras on USB (Point Grey's Firefly, Chameleon, Flea3, Grasshopper3)",
       iidc::make_usb_driver,
       "install the udev rules: vergence devices --write-udev, then plug the camera in again"},
      {"iidc-1394", "IIDC cameras on IEEE 1394", iidc::make_1394_driver,
       "install the udev rules, and add the user to the group video: sudo usermod -aG video $USER, "
       "then log in again"},
      {"v4l2", "Video4Linux: USB video class, sensors of a board, capture cards", v4l2::make_driver,
       "add the user to the group video: sudo usermod -aG video $USER, then log in again"},
  };
  return rows;
}

std::string camera_key(std::size_t k) { return fmt::format("cameras.{}", k); }

std::string camera_title(const std::string& key, const DeviceInfo& info) {
  return fmt::format("{} ({} {})", key, info.driver, info.serial);
}

std::vector<OpenedCamera> open_cameras(const Configuration& configuration,
                                       std::vector<std::string>* remarks) {
  Openings openings(configuration);
  std::vector<OpenedCamera> cameras;
  for (std::size_t k = 0; k < static_cast<std::size_t>(camera_count(configuration)); ++k) {
    cameras.push_back(openings.open(k));
    const CameraDevice& device = *cameras.back().device;
    if (const std::string remark = device.remark(); !remark.empty())
      remarks->push_back(camera_title(camera_key(k), device.info()) + ": " + remark);
  }
  return cameras;
}

}  // namespace vergence::app
