#include "app/device_replay/replayed_devices.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "app/device_replay/recorded_board.hpp"
#include "app/devices/drive_sync.hpp"
#include "app/devices/ins_drivers.hpp"
#include "app/devices/trigger_boards.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {
namespace {

[[noreturn]] void refuse_line(const ReplayedDrive& drive, const std::string& device,
                              const std::string& why) {
  throw InputError(
      fmt::format("{}: the driver of the {} does not find it in what was recorded of its line: {}; "
                  "is the configuration that of the drive?",
                  drive.name, device, why));
}

DeviceStep<InsReading> step_of(const RecordedReading& r) {
  DeviceStep<InsReading> step;
  step.value.sample = r.sample;
  step.value.quality = r.quality;
  step.value.measured = DeviceStamp(r.sample.stamp.ns());
  step.value.arrival = step.value.host = host_of(r.sample.stamp);
  step.value.host_error = r.sample.stamp_error;
  step.value.mapped = true;
  return step;
}

}  // namespace

ReplayedDevices::ReplayedDevices(const Configuration& c, const ReplayedDrive& drive,
                                 const Pixels& pixels) {
  const RecordedDevices& devices = drive.description.devices;
  const auto& frames = drive.recording.cameras;
  if (devices.cameras.size() < 2 || devices.cameras.size() > frames.size())
    throw InputError(drive.name +
                     ": is no recording of a live drive that says who its devices were; "
                     "--through-devices needs one");
  if (drive.recording.sets.empty() ||
      std::any_of(frames.begin(),
                  frames.begin() + static_cast<std::ptrdiff_t>(devices.cameras.size()),
                  [](const auto& steps) { return steps.empty(); }))
    throw InputError(drive.name +
                     ": its devices were not recorded; --through-devices needs a drive with "
                     "record: [images, pulses, raw]");
  std::vector<DeviceTiming> timings;
  for (std::size_t k = 0; k < devices.cameras.size(); ++k) {
    cameras_.push_back(std::make_unique<RecordedCamera>(
        devices.cameras[k], frames[k],
        [pixels, k](std::size_t frame) { return pixels(k, frame); }));
    timings.push_back(devices.cameras[k].timing);
  }
  options_.sync = sync_options(c, static_cast<int>(cameras_.size()));
  open_ins(c, drive);
  open_trigger(c, drive);
  // The mock's cameras are as good as the configuration says.
  if (devices.cameras[0].info.driver != "mock")
    fit_to_devices(c, timings, trigger_ != nullptr, &options_.sync);
  options_.wait_when_full = true;
  options_.board_keeps_own_time = board_place_ != nullptr;
}

std::vector<CameraDevice*> ReplayedDevices::cameras() const {
  std::vector<CameraDevice*> all;
  for (const auto& camera : cameras_) all.push_back(camera.get());
  return all;
}

void ReplayedDevices::open_ins(const Configuration& c, const ReplayedDrive& drive) {
  const auto& device = drive.description.devices.ins;
  if (!device) return;
  const InsDriverRow* row = find_ins_driver(device->info.driver);
  if (row == nullptr || drive.recording.ins.steps.empty()) {
    for (const RecordedReading& r : drive.readings) readings_.push_back(step_of(r));
    ins_ = std::make_unique<RecordedInsDevice>(*device, readings_);
    return;
  }
  auto place = std::make_unique<RecordedPlace>(drive.recording.ins, drive.recording.end());
  ins_place_ = place.get();
  DeviceStatus status = DeviceStatus::ok;
  std::string error;
  ins_ = row->open_on(std::move(place), ins_request(c.ins), &status, &error);
  if (ins_ == nullptr) refuse_line(drive, "INS", error);
  if (ins_->configure(c.ins.rate, nullptr) != DeviceStatus::ok)
    refuse_line(drive, "INS", ins_->last_error());
}

void ReplayedDevices::open_trigger(const Configuration& c, const ReplayedDrive& drive) {
  const auto& device = drive.description.devices.trigger;
  if (!device) return;
  if (drive.recording.board.steps.empty()) {
    trigger_ = std::make_unique<RecordedTrigger>(*device, drive.recording.pulses);
    return;
  }
  auto place = std::make_unique<RecordedPlace>(drive.recording.board, drive.recording.end());
  RecordedPlace& line = *place;
  board_place_ = &line;
  trigger_board::Options options = trigger_board_options(c.trigger);
  options.native_usb = trigger_board::is_native_usb(place->name());
  DeviceStatus status = DeviceStatus::ok;
  std::string error;
  auto board = trigger_board::open_on(std::move(place), options, &status, &error);
  if (board == nullptr) refuse_line(drive, "trigger board", error);
  trigger_ = std::make_unique<RecordedBoard>(std::move(board), line);
  if (trigger_->configure(trigger_configuration(c, static_cast<int>(cameras_.size())), nullptr) !=
      DeviceStatus::ok)
    refuse_line(drive, "trigger board", trigger_->last_error());
}

}  // namespace vergence::app
