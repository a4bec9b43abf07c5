#include "app/devices/mock_drive.hpp"

#include <algorithm>

#include "app/devices/drive_sync.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

namespace {

/// Checks a key that takes fewer words where cameras are the mock's.
void require_choice(const char* key, const std::string& value,
                    const std::vector<std::string>& words) {
  if (std::ranges::find(words, value) == words.end())
    throw InputError("{} is \"{}\"; with mock cameras set it to {}", key, value,
                     fmt::join(words, ", "));
}

std::vector<mock::Fault> all_faults(const Configuration& c, const std::vector<std::string>& more) {
  std::vector<mock::Fault> faults;
  const auto add = [&](const std::string& text, const std::string& where) {
    try {
      faults.push_back(mock::parse_fault(text));
    } catch (const std::invalid_argument& e) {
      throw InputError(where + ": " + e.what());
    }
  };
  for (std::size_t i = 0; i < c.faults.size(); ++i)
    if (!c.faults[i].empty()) add(c.faults[i], fmt::format("faults.{}", i));
  for (const std::string& text : more) add(text, "--fault \"" + text.substr(0, 80) + "\"");
  return faults;
}

void configured(DeviceStatus status, const std::string& what) {
  if (status != DeviceStatus::ok)
    throw InputError(what + " cannot be configured: " + std::string(to_string(status)));
}

}  // namespace

void check_drive(const Configuration& c) {
  check_cameras(c);
  require_choice("ins.driver", c.ins.driver, {"mock", "none"});
  require_choice("trigger.driver", c.trigger.driver, {"mock"});
  (void)sync_options(c, camera_count(c));
  (void)trigger_configuration(c, camera_count(c));
}

std::unique_ptr<mock::MockRig> make_mock_drive(const Configuration& c,
                                               const std::vector<std::string>& more_faults,
                                               bool real_time, std::optional<double> duration_s) {
  const RigCalibration rig = mounted_rig(c);
  const std::vector<mock::Fault> faults = all_faults(c, more_faults);
  mock::WorldOptions world{.seed = static_cast<std::uint64_t>(c.mock.seed),
                           .texture_detail = c.mock.texture_detail,
                           .hill_deg = c.mock.hill_deg};
  mock::DriveOptions way{.kind = c.mock.drive,
                         .seed = world.seed,
                         .speed = c.mock.speed,
                         .suspension = c.mock.suspension,
                         .vibration = c.mock.vibration,
                         .stop_s = c.mock.stop_s};
  // The INS sits where the configuration says: p_ins = T_ins_left p_left.
  const Transform T_body_left = mock::default_T_body_left();
  const Transform T_body_ins = T_body_left * comparison_options(c).T_ins_left.inverse();
  auto truth = std::make_shared<const mock::RigTruth>(std::make_shared<const mock::World>(world),
                                                      way, rig, T_body_left, T_body_ins, faults);
  mock::MockRigOptions o{.real_time = real_time,
                         .seed = world.seed,
                         .pattern = c.mock.pattern,
                         .noise = c.mock.noise != 0,
                         .blur_samples = c.mock.blur_samples,
                         .ideal_ins = c.mock.ins == MockSettings::Ins::ideal,
                         .clock_drift_ppm = c.mock.clock_drift_ppm};
  // Only a board is asked for pauses, which the reports announce.
  o.reports_read = c.sync.mode == SyncMode::board;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    o.trigger_delay[k] = microseconds(c.cameras[k].trigger_delay_us);
  o.exposures_follow = exposes_by_itself(c);
  if (duration_s) o.duration = Duration::seconds(*duration_s);
  auto mock = std::make_unique<mock::MockRig>(std::move(truth), o);
  for (int k = 0; k < rig.cameras; ++k) {
    CameraConfiguration requested = camera_configuration(c, static_cast<std::size_t>(k));
    requested.trigger = CameraTrigger::hardware;
    configured(mock->camera(k).configure(requested, nullptr), fmt::format("cameras.{}", k));
  }
  configured(mock->trigger().configure(trigger_configuration(c, rig.cameras), nullptr), "trigger");
  if (c.ins.driver == "mock") configured(mock->ins().configure(c.ins.rate, nullptr), "ins");
  return mock;
}

Duration stamp_grid(const Configuration& c) noexcept {
  return c.mock.pattern == mock::Pattern::gbrg ? Duration::microseconds(1)
                                               : Duration::nanoseconds(1);
}

std::vector<StampedPose> true_trajectory(const mock::MockRig& rig, const Configuration& c,
                                         Stamp start) {
  std::vector<StampedPose> poses;
  for (const Duration pulse : rig.pulse_times()) {
    const Duration middle = pulse + microseconds(c.cameras[0].trigger_delay_us) +
                            Duration::seconds(c.cameras[0].exposure_us * 0.5e-6);
    poses.push_back({start + middle, rig.truth().camera_in_enu(0, middle)});
  }
  return poses;
}

}  // namespace vergence::app
