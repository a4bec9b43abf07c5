#include "app/devices/drive_sync.hpp"

#include <filesystem>
#include <set>
#include <utility>

#include "app/devices/rig_settings.hpp"
#include "app/devices/serial_devices.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

int cameras_of(const Configuration& c) {
  int n = 0;
  for (const CameraSettings& s : c.cameras) n += s.driver.empty() ? 0 : 1;
  return n;
}

TEST(DriveSync, examplesLoadAndCoverEveryMode) {
  std::set<SyncMode> modes;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(VERGENCE_SOURCE_DIR "/app/config")) {
    if (entry.path().extension() != ".yaml") continue;
    SCOPED_TRACE(entry.path().filename());
    ++files;
    try {
      const Configuration c = load_configuration(entry.path(), {});
      const SyncOptions o = sync_options(c, cameras_of(c));
      EXPECT_EQ(o.validate(), nullptr);
      EXPECT_GT(trigger_configuration(c, cameras_of(c)).rate_hz, 0);
      modes.insert(o.mode);
    } catch (const InputError& e) {
      ADD_FAILURE() << e.what();
    }
  }
  EXPECT_GE(files, 13);
  EXPECT_EQ(modes.size(), 8U);
}

constexpr const char* kTwoGige =
    "cameras: [{driver: gige, exposure_us: 4000}, {driver: gige, exposure_us: 4000}]\n";

std::string refusal(const std::string& yaml) {
  return test::refusal_of([&] {
    const Configuration mine = parse_configuration(
        yaml.find("cameras:") == std::string::npos ? kTwoGige + yaml : yaml, "t", {});
    (void)sync_options(mine, 2);
    (void)trigger_configuration(mine, 2);
  });
}

TEST(DriveSync, unpairableConfigurationsAreRefused) {
  for (const auto& [yaml, mentions] : std::vector<std::pair<const char*, const char*>>{
           {"sync: {mode: bord}", "did you mean \"board\"?"},
           {"sync: {mode: board}", "set trigger.driver to board, or sync.mode to frame_counter"},
           {"sync: {mode: ins_syncout}", "has no SyncOut"},
           {"sync: {mode: ins_syncout}\nins: {driver: xsens}", "set ins.sync_out_hz"},
           {"sync: {mode: ins_syncout}\nins: {driver: xsens, sync_out_hz: 25}\ntrigger: {rate: 30}",
            "both to one rate"},
           {"sync: {mode: ieee1394_cycle_time}", "share a cycle timer"},
           {"sync: {mode: ptp}", "lacks ptp: on"},
           {"sync: {mode: side_by_side}", "cameras.0.image_half is whole"},
           {"sync: {mode: master_strobe}", "camera 0 triggers the others; set it to free"},
           {"sync: {mode: master_strobe}\ncameras: [{driver: gige, trigger: free}, {driver: "
            "gige, trigger: free}]",
            "the strobe of camera 0 triggers this camera"},
           {"cameras: [{driver: gige, trigger: free}, {driver: gige, trigger: free}]",
            "set sync.mode to approximate_time"},
           {"sync: {mode: board}\ntrigger: {driver: board, rate: 200, dither_us: 1500}",
            "the camera would miss pulses"},
           {"sync: {mode: board}\ntrigger: {driver: board, rate: 100, dither_us: 6000}",
            "more than half of the 10000"},
           {"sync: {mode: board}\ntrigger: {driver: board, rate: 10, dither_us: 20000, width_us: "
            "90000}",
            "a pulse would last until the next"},
           {"sync: {mode: board}\ntrigger: {driver: board, lines: 1}",
            "without the line of a camera"},
           {"sync: {mode: board}\ntrigger: {driver: board, pps: up}",
            "it must be one of none, rising, falling"},
           {"sync: {mode: approximate_time, tolerance_ms: 100}",
            "at most half of the frame interval"}})
    EXPECT_TRUE(test::mentions(refusal(yaml), mentions)) << yaml;
}

}  // namespace
}  // namespace vergence::app
