#include "app/devices/camera_drivers.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "drivers/common/side_by_side_camera.hpp"
#include "drivers/gige/gige.hpp"
#include "drivers/iidc/iidc.hpp"
#include "drivers/v4l2/v4l2.hpp"

namespace vergence::app {
namespace {

const CameraDriverRow& row_of(const CameraRequest& request) {
  for (const CameraDriverRow& row : camera_driver_rows())
    if (request.driver == row.name) return row;
  const auto names = camera_driver_names();
  throw InputError(fmt::format("{}.driver is \"{}\"{}; supported: {}", request.key, request.driver,
                               did_you_mean(request.driver, names), fmt::join(names, ", ")));
}

std::string list_of(const std::vector<DeviceInfo>& found) {
  if (found.empty()) return "none was found";
  std::string text = "found:";
  for (const DeviceInfo& d : found)
    text += fmt::format("{} {} ({}, {})", &d == found.data() ? "" : ",",
                        d.serial.empty() ? "without a serial" : d.serial, d.model, d.place);
  return text;
}

/// The message for an open() that gave nothing.
std::string refusal(const CameraRequest& request, const std::string& serial,
                    const CameraDriverRow& row, CameraDriver& driver, DeviceStatus status) {
  const std::string who = fmt::format("{}: the {} camera {}", request.key, row.name,
                                      serial.empty() ? "" : "\"" + serial + "\" ");
  std::string error = driver.last_error();
  switch (status) {
    case DeviceStatus::not_found:
      return fmt::format("{}was not found; {}; check cable, power and {}.serial{}", who,
                         list_of(driver.enumerate()), request.key,
                         error.empty() ? "" : ": " + error);
    case DeviceStatus::busy:
      return fmt::format("{}is in use by another program; end that one{}", who,
                         error.empty() ? "" : ": " + error);
    case DeviceStatus::no_permission:
      return fmt::format("{}cannot be opened without permission; {}", who,
                         error.empty() ? row.permission : error);
    default:
      return fmt::format("{}cannot be opened: {}", who,
                         error.empty() ? std::string(to_string(status)) : error);
  }
}

bool are_one_camera(const CameraRequest& a, const CameraRequest& b) {
  return a.half != ImageHalf::whole && b.half != ImageHalf::whole && a.half != b.half &&
         a.driver == b.driver && a.serial == b.serial;
}

/// A half needs its other one, asked for in the same way.
void check_half(const CameraRequest& request, const std::vector<CameraRequest>& requests) {
  if (request.half == ImageHalf::whole) return;
  const auto other = std::find_if(requests.begin(), requests.end(), [&](const CameraRequest& r) {
    return are_one_camera(r, request);
  });
  const bool left = request.half == ImageHalf::left;
  if (other == requests.end())
    throw InputError(fmt::format(
        "{}.image_half is {}, and no other entry is the {} half of the same image: give one the "
        "same driver and serial, and image_half: {}",
        request.key, left ? "left" : "right", left ? "right" : "left", left ? "right" : "left"));
  const CameraConfiguration& a = request.configuration;
  const CameraConfiguration& b = other->configuration;
  if (a.exposure != b.exposure || a.gain_db != b.gain_db || a.pixel_format != b.pixel_format ||
      a.offset_x != b.offset_x || a.offset_y != b.offset_y ||
      options_text(a.options) != options_text(b.options))
    throw InputError(
        fmt::format("{} and {} are halves of one camera's image and differ: set exposure_us, "
                    "gain_db, pixel_format, offset and options equally",
                    request.key, other->key));
}

/// The drivers in use, and who is taken.
class Openings {
 public:
  explicit Openings(const std::vector<CameraRequest>& requests) {
    for (const CameraRequest& r : requests) {
      check_half(r, requests);
      if (r.half == ImageHalf::right) continue;  // its left half stands for the camera
      ++sharing_[r.driver];
      if (!r.serial.empty()) taken_.emplace_back(r.driver, r.serial);
    }
    for (const auto& [name, serial] : taken_)
      if (std::count(taken_.begin(), taken_.end(), std::pair(name, serial)) > 1)
        throw InputError(fmt::format(
            "two entries of cameras have the serial \"{}\"; each camera can be one only", serial));
  }

  OpenedCamera open(const CameraRequest& request) {
    OpenedCamera opened;
    opened.device = request.half == ImageHalf::whole ? open_device(request) : open_half(request);
    CameraConfiguration requested = request.configuration;
    requested.sharing = sharing_[request.driver];
    const DeviceStatus status = opened.device->configure(requested, &opened.actual);
    require_configured(camera_title(request.key, opened.device->info()), status,
                       opened.device->last_error());
    return opened;
  }

 private:
  struct OpenHalf {
    const CameraRequest* of;
    std::unique_ptr<CameraDevice> device;
  };

  /// The camera behind two entries is opened with the first of them.
  std::unique_ptr<CameraDevice> open_half(const CameraRequest& request) {
    for (OpenHalf& h : halves_)
      if (are_one_camera(*h.of, request) && h.device != nullptr) return std::move(h.device);
    auto [left, right] = split_side_by_side(open_device(request));
    const bool is_left = request.half == ImageHalf::left;
    halves_.push_back({&request, is_left ? std::move(right) : std::move(left)});
    return is_left ? std::move(left) : std::move(right);
  }

  std::unique_ptr<CameraDevice> open_device(const CameraRequest& request) {
    const CameraDriverRow& row = row_of(request);
    std::unique_ptr<CameraDriver>& driver = drivers_[request.driver];
    if (driver == nullptr) driver = row.make();
    std::string serial = request.serial;
    if (serial.empty()) serial = next(request, *driver);
    DeviceStatus status = DeviceStatus::ok;
    auto device = driver->open(serial, &status);
    if (device == nullptr) refuse_device(status, refusal(request, serial, row, *driver, status));
    return device;
  }

  /// The serial of the next camera that nobody has or names.
  std::string next(const CameraRequest& request, CameraDriver& driver) {
    const std::vector<DeviceInfo> found = driver.enumerate();
    for (const DeviceInfo& d : found) {
      const std::pair who(request.driver, d.serial);
      if (std::find(taken_.begin(), taken_.end(), who) != taken_.end()) continue;
      taken_.push_back(who);
      return d.serial;
    }
    const std::string error = driver.last_error();
    throw DeviceError(fmt::format(
        "{}: no unassigned {} camera was found; {}; check cable and power{}", request.key,
        request.driver, list_of(found), error.empty() ? "" : ": " + error));
  }

  std::map<std::string, std::unique_ptr<CameraDriver>> drivers_;
  std::map<std::string, int> sharing_;
  std::vector<OpenHalf> halves_;  // opened with the other one, not asked for yet
  std::vector<std::pair<std::string, std::string>> taken_;  // driver, serial
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

std::vector<std::string> camera_driver_names() {
  std::vector<std::string> names;
  for (const CameraDriverRow& row : camera_driver_rows()) names.emplace_back(row.name);
  return names;
}

std::string camera_title(const std::string& key, const DeviceInfo& info) {
  return fmt::format("{} ({} {})", key, info.driver, info.serial);
}

std::vector<OpenedCamera> open_cameras(const std::vector<CameraRequest>& requests,
                                       std::vector<std::string>* remarks) {
  Openings openings(requests);
  std::vector<OpenedCamera> cameras;
  for (const CameraRequest& request : requests) {
    cameras.push_back(openings.open(request));
    const std::string remark = cameras.back().device->remark();
    if (!remark.empty())
      remarks->push_back(camera_title(request.key, cameras.back().device->info()) + ": " + remark);
  }
  return cameras;
}

}  // namespace vergence::app
