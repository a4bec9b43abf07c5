#include "app/config/calibration_state.hpp"

#include <cstdlib>

#include "tests/support/parallel_rig.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

/// Sets a variable of the environment for a scope; nullptr: there is none.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) {
    if (const char* old = std::getenv(name)) former_ = old;
    set(value);
  }
  ~Environment() { set(former_ ? former_->c_str() : nullptr); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  void set(const char* value) const {
    if (value != nullptr)
      ::setenv(name_, value, 1);
    else
      ::unsetenv(name_);
  }
  const char* name_;
  std::optional<std::string> former_;
};

RigSettings rig(const std::string& name, const std::string& state_dir = "") {
  RigSettings r{.name = name, .state_dir = state_dir};
  return r;
}

TEST(StateFile, folderFollowsKeyOrEnvironment) {
  const Environment home("HOME", "/users/anna");
  {
    const Environment state("XDG_STATE_HOME", "/var/state");
    EXPECT_EQ(state_file(rig("van")), "/var/state/vergence/van/calibration_state.yaml");
    EXPECT_EQ(state_file(rig("van", "/srv/rigs")), "/srv/rigs/calibration_state.yaml");
    EXPECT_EQ(state_file(rig("van", "none")), std::nullopt);
  }
  for (const char* useless : {static_cast<const char*>(nullptr), "", "relative/path"}) {
    const Environment state("XDG_STATE_HOME", useless);
    EXPECT_EQ(state_file(rig("van")),
              "/users/anna/.local/state/vergence/van/calibration_state.yaml");
  }
  const Environment state("XDG_STATE_HOME", nullptr), homeless("HOME", nullptr);
  EXPECT_EQ(state_file(rig("van")), std::nullopt);
}

TEST(StateFile, nameOfRigNeverLeavesFolder) {
  const Environment state("XDG_STATE_HOME", "/s");
  EXPECT_EQ(state_file(rig("../../etc")), "/s/vergence/_._.._etc/calibration_state.yaml");
  EXPECT_EQ(state_file(rig("..")), "/s/vergence/_./calibration_state.yaml");
  EXPECT_EQ(state_file(rig("a b/c")), "/s/vergence/a_b_c/calibration_state.yaml");
  EXPECT_EQ(state_file(rig("")), "/s/vergence/rig/calibration_state.yaml");
}

CalibrationFile two_cameras() {
  CalibrationFile file;
  file.rig = test::parallel_rig(test::pinhole(640, 480, 460), 0.75);
  file.rig.T_camera_left[1].t = {-0.75, 0.001, 0.002};
  file.rig.T_camera_left[1].t *= 0.75 / file.rig.T_camera_left[1].t.norm();
  file.serials = {"101", "102", "", ""};
  file.source = "online";
  return file;
}

/// A two-camera file with the configured values.
CalibrationFile configured() {
  CalibrationFile file = two_cameras();
  file.configured = {{"rig.nominal.baseline_m", "0.75"},
                     {"cameras.1.model", "pinhole-equidistant"}};
  return file;
}

TEST(StateFile, stateOfOtherRigIsRefusedWithReason) {
  const test::TemporaryFolder folder;
  const auto path = folder / "not/there/yet/calibration_state.yaml";
  const CalibrationState first = read_state(path, configured());
  EXPECT_FALSE(first.calibration);
  EXPECT_EQ(first.message, "") << "a first drive is nothing to tell";
  write_state(path, configured());
  const CalibrationState same = read_state(path, configured());
  ASSERT_TRUE(same.calibration) << same.message;
  EXPECT_EQ(same.calibration->serials, configured().serials);
  EXPECT_EQ(same.calibration->configured, configured().configured);
  struct Change {
    const char* why;
    void (*of)(CalibrationFile*);
  };
  for (const Change& c : {
           Change{"serial \"102\", the connected one \"103\"",
                  [](CalibrationFile* f) { f->serials[1] = "103"; }},
           Change{"2 cameras, the configuration 3", [](CalibrationFile* f) { f->rig.cameras = 3; }},
           Change{"640 x 480", [](CalibrationFile* f) { f->rig.intrinsics[0].width = 1280; }},
           Change{
               "rig.nominal.baseline_m was 0.75 when it was saved and is now 0.7512",
               [](CalibrationFile* f) { (*f->configured)["rig.nominal.baseline_m"] = "0.7512"; }},
           Change{
               "cameras.1.model was pinhole-equidistant when it was saved and is now its default",
               [](CalibrationFile* f) { f->configured->erase("cameras.1.model"); }},
           Change{"cameras.0.offset.0 was its default when it was saved and is now 200",
                  [](CalibrationFile* f) { (*f->configured)["cameras.0.offset.0"] = "200"; }},
           Change{"its baseline is 0.75 m, the configuration's 0.8 m",
                  [](CalibrationFile* f) { f->rig.baseline = 0.8; }},
       }) {
    CalibrationFile expected = configured();
    c.of(&expected);
    const CalibrationState state = read_state(path, expected);
    EXPECT_FALSE(state.calibration) << c.why;
    EXPECT_TRUE(test::mentions(state.message, c.why, "calibration_state.yaml: is not used"));
  }
}

TEST(StateFile, onlyKeysOfCalibrationAreCompared) {
  const Configuration c = parse_configuration(
      "rig: {name: van, nominal: {baseline_m: 0.5}}\n"
      "cameras: [{serial: A, exposure_us: 500}, {intrinsics: [1, 2, 3, 4], offset: [8, 0]}]\n",
      "drive.yaml", {});
  std::string keys;
  for (const auto& [key, value] : configured_rig(c)) keys += key + " ";
  EXPECT_EQ(keys,
            "cameras.1.intrinsics.0 cameras.1.intrinsics.1 cameras.1.intrinsics.2 "
            "cameras.1.intrinsics.3 cameras.1.offset.0 rig.nominal.baseline_m ");
}

TEST(StateFile, damagedStateGivesMessageOnly) {
  const test::TemporaryFolder folder;
  folder.write("calibration_state.yaml", "version: 1\ncameras: [{name: left");
  const CalibrationState state = read_state(folder / "calibration_state.yaml", two_cameras());
  EXPECT_FALSE(state.calibration);
  EXPECT_NE(state.message.find("the run starts without it"), std::string::npos) << state.message;
}

}  // namespace
}  // namespace vergence::app
