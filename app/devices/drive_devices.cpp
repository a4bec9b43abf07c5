#include "app/devices/drive_devices.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "app/devices/drive_sync.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

bool all_mock(const Configuration& c) {
  return std::all_of(c.cameras.begin(), c.cameras.end(), [](const CameraSettings& s) {
    return s.driver.empty() || s.driver == "mock";
  });
}

/// Checks that a configuration suits real devices before opening them.
std::vector<CameraRequest> make_requests(const Configuration& c) {
  std::vector<CameraRequest> requests;
  const int cameras = nominal_rig(c).cameras;
  if (cameras < 2)
    throw InputError(
        "cameras: one camera is configured, two are needed for scale; for example cameras: "
        "[{driver: gige}, {driver: gige}]");
  for (int k = 0; k < cameras; ++k) {
    const CameraSettings& s = c.cameras[static_cast<std::size_t>(k)];
    const std::string key = fmt::format("cameras.{}", k);
    if (s.driver == "mock")
      throw InputError(key +
                       ".driver is mock, but another camera is real; simulated and real cameras "
                       "cannot be mixed");
    if (s.width != c.cameras[0].width || s.height != c.cameras[0].height)
      throw InputError(fmt::format(
          "{}.size is {} x {}, that of camera 0 is {} x {}; all cameras of a rig have one size",
          key, s.width, s.height, c.cameras[0].width, c.cameras[0].height));
    CameraRequest r;
    r.key = key;
    r.driver = s.driver;
    r.serial = s.serial;
    r.half = s.half;
    const ExposureSetting start = starting_exposure(c, static_cast<std::size_t>(k));
    r.configuration = {s.width, s.height, c.trigger.rate, start.exposure, start.gain_db, s.trigger};
    r.configuration.offset_x = s.offset_x;
    r.configuration.offset_y = s.offset_y;
    r.configuration.pixel_format = s.pixel_format;
    r.configuration.options = s.options;
    if (c.sync.mode != SyncMode::master_strobe && s.trigger != c.cameras[0].trigger)
      throw InputError(fmt::format(
          "{}.trigger is {}, that of camera 0 is {}; all cameras of a rig are triggered alike", key,
          to_string(s.trigger), to_string(c.cameras[0].trigger)));
    requests.push_back(std::move(r));
  }
  if (c.trigger.driver != "none" && c.trigger.driver != "board")
    throw InputError(
        fmt::format("trigger.driver is \"{}\"{}; with real cameras it is board, or none where "
                    "something else pulses",
                    c.trigger.driver, did_you_mean(c.trigger.driver, {"board", "none"})));
  if (c.trigger.driver == "board" && requests[0].configuration.trigger != CameraTrigger::hardware)
    throw InputError(
        fmt::format("trigger.driver is board and cameras[].trigger {}; the board's pulses are for "
                    "cameras with trigger: hardware",
                    to_string(c.cameras[0].trigger)));
  return requests;
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
  for (int k = 0; k < mock_.rig->cameras(); ++k) cameras_.push_back(&mock_.rig->camera(k));
  if (mock_.has_ins) ins_ = &mock_.rig->ins();
  trigger_ = &mock_.rig->trigger();
  sync_ = sync_options(c, mock_.rig->cameras());
  frames_ = mock_.rig->pulses(c.trigger.rate);
}

void DriveDevices::open_real(const Configuration& c) {
  const std::vector<CameraRequest> requests = make_requests(c);
  sync_ = sync_options(c, static_cast<int>(requests.size()));
  const TriggerConfiguration pulses = trigger_configuration(c, sync_.cameras);
  opened_ = open_cameras(requests, &remarks_);
  for (const OpenedCamera& camera : opened_) cameras_.push_back(camera.device.get());
  opened_ins_ = open_ins(ins_request(c.ins), &remarks_);
  ins_ = opened_ins_.get();
  if (sync_.mode == SyncMode::ins_syncout) check_sync_out(c, ins_->info());
  if (c.trigger.driver == "board") {
    board_ = open_trigger_board(c.trigger, pulses, &remarks_);
    trigger_ = board_.get();
  }
  std::vector<DeviceTiming> timings;
  for (const OpenedCamera& camera : opened_) timings.push_back(camera.device->timing());
  fit_to_devices(c, timings, trigger_ != nullptr, &sync_);
  const CameraTrigger trigger = requests[0].configuration.trigger;
  if (trigger == CameraTrigger::software) {
    software_ = std::make_unique<SoftwareTrigger>(cameras_);
    if (software_->configure(pulses, nullptr) != DeviceStatus::ok)
      throw InputError("trigger.rate is not possible");
    trigger_ = software_.get();
  }
  start_ = monotonic_now();
}

Acquisition::Options DriveDevices::acquisition_options() const {
  Acquisition::Options o;
  o.sync = sync_;
  o.wait_when_full = fast_;
  return o;
}

std::span<const mock::Fault> DriveDevices::faults() const noexcept {
  if (mock_.rig == nullptr) return {};
  return mock_.rig->truth().faults();
}

HostStamp DriveDevices::start() const noexcept { return mock_.rig ? mock_.rig->start() : start_; }

}  // namespace vergence::app
