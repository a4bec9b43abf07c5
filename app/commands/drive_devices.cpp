#include "app/commands/drive_devices.hpp"

#include <time.h>

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "app/commands/exposure_settings.hpp"
#include "app/commands/simulated_ins.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/software_trigger.hpp"

namespace vergence::app {
namespace {

HostStamp monotonic_now() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return HostStamp(static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec);
}

bool all_mock(const Configuration& c) {
  return std::all_of(c.cameras.begin(), c.cameras.end(), [](const CameraSettings& s) { return s.driver.empty() || s.driver == "mock"; });
}

CameraTrigger trigger_of(const std::string& key, const std::string& word) {
  if (word == "hardware") return CameraTrigger::hardware;
  if (word == "software") return CameraTrigger::software;
  if (word == "free") return CameraTrigger::free;
  throw InputError(fmt::format("{}.trigger is \"{}\"{}; it is one of hardware, software, free", key, word,
                               did_you_mean(word, {"hardware", "software", "free"})));
}

SyncOptions sync_options(const Configuration& c, int cameras) {
  SyncOptions o;
  o.cameras = cameras;
  o.interval = Duration::seconds(1 / c.trigger.rate);
  o.hold = Duration::seconds(c.sync.hold_ms * 1e-3);
  o.tolerance = Duration::seconds(c.sync.tolerance_ms * 1e-3);
  if (c.sync.mode == "software")
    o.mode = SyncMode::software;
  else if (c.sync.mode != "counter")
    throw InputError(fmt::format("sync.mode is \"{}\"{}; this version knows counter, software", c.sync.mode,
                                 did_you_mean(c.sync.mode, {"counter", "software"})));
  if (const char* sentence = o.validate()) throw InputError(std::string("sync: ") + sentence);
  return o;
}

/// What real devices need of a configuration before any of them is opened.
std::vector<CameraRequest> requests_of(const Configuration& c) {
  std::vector<CameraRequest> requests;
  const int cameras = nominal_rig(c).cameras;
  if (cameras < 2) throw InputError("one camera alone has no scale; two are the least, cameras: [{driver: gige}, {driver: gige}]");
  for (int k = 0; k < cameras; ++k) {
    const CameraSettings& s = c.cameras[static_cast<std::size_t>(k)];
    const std::string key = fmt::format("cameras.{}", k);
    if (s.driver == "mock") throw InputError(key + ".driver is mock, another camera is real; a mock's cameras share one world");
    if (s.width != c.cameras[0].width || s.height != c.cameras[0].height)
      throw InputError(fmt::format("{}.size is {} x {}, that of camera 0 is {} x {}; all cameras of a rig have one size", key, s.width,
                                   s.height, c.cameras[0].width, c.cameras[0].height));
    CameraRequest r;
    r.key = key;
    r.driver = s.driver;
    r.serial = s.serial;
    const ExposureSetting start = starting_exposure(c, static_cast<std::size_t>(k));
    r.configuration = {s.width, s.height, c.trigger.rate, start.exposure, start.gain_db, trigger_of(key, s.trigger)};
    r.configuration.offset_x = s.offset_x;
    r.configuration.offset_y = s.offset_y;
    r.configuration.pixel_format = s.pixel_format;
    r.configuration.options = parse_camera_options(key + ".options", s.options);
    if (r.configuration.trigger != trigger_of("cameras.0", c.cameras[0].trigger))
      throw InputError(fmt::format("{}.trigger is {}, that of camera 0 is {}; all cameras of a rig are triggered alike", key, s.trigger,
                                   c.cameras[0].trigger));
    requests.push_back(std::move(r));
  }
  if (c.trigger.driver != "none")
    throw InputError(
        fmt::format("trigger.driver is \"{}\"; with real cameras this version knows none: pulses from elsewhere, "
                    "cameras[].trigger: software, or free",
                    c.trigger.driver));
  if (requests[0].configuration.trigger == CameraTrigger::free && c.sync.mode == "counter")
    throw InputError(
        "cameras[].trigger is free: nothing makes the cameras expose together, so their counters cannot pair the images; "
        "trigger them, or set sync.mode to software");
  return requests;
}

InsRequest ins_request(const InsSettings& s) {
  return {s.driver, s.port, s.rate, static_cast<std::uint32_t>(s.baud), s.sync_out_hz, s.sync_out_width_ms, s.sync_in, s.processing_ms};
}

}  // namespace

std::map<std::string, std::string> parse_camera_options(const std::string& key, const std::string& text) {
  std::map<std::string, std::string> options;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size())
      throw InputError(fmt::format("{} has \"{}\"; it takes NAME=VALUE, as in packet_size=9000, or a group {{packet_size: 9000}}", key,
                                   word.substr(0, 60)));
    options.insert_or_assign(word.substr(0, equals), word.substr(equals + 1));
  }
  return options;
}

DriveDevices::DriveDevices(const Configuration& c, const std::vector<std::string>& faults, bool fast, std::optional<double> duration_s) {
  if (!all_mock(c)) {
    if (fast) throw InputError("--fast is virtual time, which real cameras do not keep; run without it");
    if (!faults.empty()) throw InputError("--fault is for the mock; real cameras have their own");
    open_real(c);
    if (duration_s) frames_ = static_cast<std::uint64_t>(*duration_s * c.trigger.rate) + 1;
    return;
  }
  check_drive(c);
  mock_ = make_mock_drive(c, faults, !fast, duration_s);
  for (int k = 0; k < mock_.rig->cameras(); ++k) cameras_.push_back(&mock_.rig->camera(k));
  if (mock_.has_ins) ins_ = &mock_.rig->ins();
  if (mock_.has_ins && c.mock.ins_line != "none") {
    if (!fast) throw InputError("mock.ins_line is \"" + c.mock.ins_line + "\", a line in virtual time; run with --fast, or set it to none");
    opened_ins_ = make_simulated_ins(c, *mock_.rig, &remarks_);
    ins_ = opened_ins_.get();
  }
  trigger_ = &mock_.rig->trigger();
  sync_ = sync_options(c, mock_.rig->cameras());
  frames_ = mock_.rig->pulses(c.trigger.rate);
}

void DriveDevices::open_real(const Configuration& c) {
  const std::vector<CameraRequest> requests = requests_of(c);
  sync_ = sync_options(c, static_cast<int>(requests.size()));
  opened_ = open_cameras(requests, &remarks_);
  for (const OpenedCamera& camera : opened_) cameras_.push_back(camera.device.get());
  opened_ins_ = open_ins(ins_request(c.ins), &remarks_);
  ins_ = opened_ins_.get();
  const CameraTrigger trigger = requests[0].configuration.trigger;
  sync_.align_start = trigger == CameraTrigger::hardware;  // the pulses do not wait for us
  if (trigger == CameraTrigger::software) {
    software_ = std::make_unique<SoftwareTrigger>(cameras_);
    if (software_->configure({c.trigger.rate}, nullptr) != DeviceStatus::ok) throw InputError("trigger.rate is not possible");
    trigger_ = software_.get();
  }
  if (sync_.mode == SyncMode::software)
    remarks_.push_back(
        fmt::format("sync.mode is software: images within {} ms are paired by their stamps; that they were exposed together is "
                    "not known, and poses in motion suffer from it",
                    c.sync.tolerance_ms));
  start_ = monotonic_now();
}

std::span<const mock::Fault> DriveDevices::faults() const noexcept {
  if (mock_.rig == nullptr) return {};
  return mock_.rig->truth().faults();
}

HostStamp DriveDevices::start() const noexcept { return mock_.rig ? mock_.rig->start() : start_; }

}  // namespace vergence::app
