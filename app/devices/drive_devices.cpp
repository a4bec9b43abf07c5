#include "app/devices/drive_devices.hpp"

#include <algorithm>

#include "app/devices/drive_sync.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

bool all_mock(const Configuration& c) {
  return std::ranges::all_of(
      c.cameras, [](const CameraSettings& s) { return s.driver.empty() || s.driver == "mock"; });
}

/// Checks that a configuration suits real devices before opening them.
void check_real_drive(const Configuration& c) {
  check_cameras(c);
  (void)nominal_rig(c);
  for (std::size_t k = 0; k < static_cast<std::size_t>(camera_count(c)); ++k) {
    const CameraSettings& s = c.cameras[k];
    if (s.driver == "mock")
      throw InputError(camera_key(k) +
                       ".driver is mock, but another camera is real; simulated and real cameras "
                       "cannot be mixed");
    if (c.sync.mode != SyncMode::master_strobe && s.trigger != c.cameras[0].trigger)
      throw InputError(
          "{}.trigger is {}, but that of camera 0 is {}; set the same trigger for all cameras",
          camera_key(k), to_string(s.trigger), to_string(c.cameras[0].trigger));
  }
  for (const auto& [key, driver] :
       {std::pair{"trigger.driver", c.trigger.driver}, std::pair{"ins.driver", c.ins.driver}})
    if (driver == "mock")
      throw InputError(std::string(key) +
                       " is mock, but the cameras are real; simulated and real devices cannot be "
                       "mixed");
  if (c.trigger.driver == "board" && c.cameras[0].trigger != CameraTrigger::hardware)
    throw InputError(
        "trigger.driver is board, but cameras.N.trigger is {}; set cameras.N.trigger to hardware, "
        "or trigger.driver to none",
        to_string(c.cameras[0].trigger));
}

}  // namespace

void start_acquisition(Acquisition* acquisition, PulseObserver* observer) {
  const auto failure = acquisition->start(observer);
  if (!failure) return;
  const std::string why = failure->message.empty()
                              ? std::string(to_string(failure->status)) +
                                    "; check its cable and its section of the configuration"
                              : failure->message;
  refuse_device(failure->status, failure->device.driver + " " + failure->device.serial +
                                     " cannot be started: " + why);
}

DriveDevices::DriveDevices(const Configuration& c, const std::vector<std::string>& faults,
                           bool fast, std::optional<double> duration_s)
    : fast_(fast) {
  if (!all_mock(c)) {
    if (fast) throw InputError("--fast needs simulated cameras; remove it");
    if (!faults.empty())
      throw InputError("--fault needs simulated cameras (driver: mock); remove it");
    open_real(c);
    if (duration_s) frames_ = static_cast<std::uint64_t>(*duration_s * c.trigger.rate) + 1;
    return;
  }
  check_drive(c);
  mock_ = make_mock_drive(c, faults, !fast, duration_s);
  for (int k = 0; k < mock_->cameras(); ++k) cameras_.push_back(&mock_->camera(k));
  if (c.ins.driver == "mock") ins_ = &mock_->ins();
  trigger_ = &mock_->trigger();
  sync_ = sync_options(c, mock_->cameras());
  frames_ = mock_->pulses(c.trigger.rate);
}

void DriveDevices::open_real(const Configuration& c) {
  check_real_drive(c);
  sync_ = sync_options(c, camera_count(c));
  const TriggerConfiguration pulses = trigger_configuration(c, sync_.cameras);
  opened_ = open_cameras(c, &remarks_);
  for (const OpenedCamera& camera : opened_) cameras_.push_back(camera.device.get());
  opened_ins_ = open_ins(c.ins, &remarks_);
  ins_ = opened_ins_.get();
  if (sync_.mode == SyncMode::ins_syncout) check_sync_out(c, ins_->info());
  if (c.trigger.driver == "board") {
    board_ = open_trigger_board(c.trigger, pulses, &remarks_);
    trigger_ = board_.get();
  }
  std::vector<DeviceTiming> timings;
  for (const OpenedCamera& camera : opened_) timings.push_back(camera.device->timing());
  fit_to_devices(c, timings, trigger_ != nullptr, &sync_);
  if (c.cameras[0].trigger == CameraTrigger::software) {
    software_ = make_software_trigger(cameras_);
    if (software_->configure(pulses, nullptr) != DeviceStatus::ok)
      throw InputError("trigger.rate is not possible");
    trigger_ = software_.get();
  }
  start_ = monotonic_now();
}

std::span<const mock::Fault> DriveDevices::faults() const noexcept {
  if (mock_ == nullptr) return {};
  return mock_->truth().faults();
}

}  // namespace vergence::app
