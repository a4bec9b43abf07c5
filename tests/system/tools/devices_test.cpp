#include <algorithm>

#include <nlohmann/json.hpp>

#include "tests/support/gige_camera.hpp"
#include "tests/support/refusal.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using nlohmann::json;
using test::contains;
using test::Outcome;
using test::run_vergence;

TEST(Devices, networkCameraIsListedWithItsConfiguration) {
  test::GigeCameraOptions o{.address = test::GigeCamera::address(60), .serial = "TOOL-60"};
  const test::GigeCamera camera(o);
  const Outcome listed = run_vergence("devices");
  EXPECT_EQ(listed.code, 0) << listed.err;
  EXPECT_EQ(listed.err, "");
  EXPECT_TRUE(contains(listed.out, "    - {driver: gige, serial: \"TOOL-60\"}  # ")) << listed.out;
  const Outcome for_programs = run_vergence("devices --json");
  EXPECT_EQ(for_programs.code, 0);
  const json all = json::parse(for_programs.out);
  const auto found = std::find_if(all["cameras"].begin(), all["cameras"].end(),
                                  [](const json& c) { return c["serial"] == "TOOL-60"; });
  ASSERT_NE(found, all["cameras"].end()) << for_programs.out;
  EXPECT_EQ((*found)["place"], o.address);
  EXPECT_EQ((*found)["driver"], "gige");
  for (const char* key : {"driver", "serial", "model", "place", "configuration"})
    EXPECT_TRUE(found->contains(key)) << key;
  ASSERT_EQ(all["drivers"].size(), 4U);
  for (const json& d : all["drivers"]) EXPECT_EQ(d["answered"], true) << d;
  EXPECT_TRUE(all["serial_ports"].is_array());
  EXPECT_FALSE(all.contains("udev_rules"));
}

TEST(Devices, udevRulesAreWrittenToFileJsonOrStdout) {
  const Outcome out = run_vergence("devices --write-udev");
  EXPECT_EQ(out.code, 0);
  EXPECT_TRUE(out.out.starts_with("# Devices of this rig")) << out.out;
  const test::TemporaryFolder folder;
  const auto file = folder / "98-rig.rules";
  const Outcome written = run_vergence("devices --json --write-udev '" + file.string() + "'");
  EXPECT_EQ(written.code, 0);
  EXPECT_TRUE(contains(written.err, "udevadm control --reload")) << written.err;
  EXPECT_EQ(test::read_file(file), out.out);
  EXPECT_FALSE(json::parse(written.out).contains("udev_rules"));
  EXPECT_EQ(json::parse(run_vergence("devices --write-udev --json").out)["udev_rules"], out.out);
  const Outcome refused = run_vergence("devices --write-udev /no/such/folder/98.rules");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "sudo tee /no/such/folder/98.rules")) << refused.err;
}

const std::string kConfigurations = std::string(VERGENCE_SOURCE_DIR) + "/app/config/";

/// The findings of one check.
json of(const json& all, const std::string& check) {
  json some = json::array();
  for (const json& f : all["findings"])
    if (f["check"] == check) some.push_back(f);
  return some;
}

TEST(Doctor, simulatedRigNeedsNoDevice) {
  const Outcome o = run_vergence("doctor '" + kConfigurations + "mock.yaml' --json");
  const json all = json::parse(o.out);
  EXPECT_EQ(o.code, all["problems"] == 0 ? 0 : 1);
  for (const char* check : {"cameras", "receive_buffer", "usb_memory", "ins"})
    EXPECT_TRUE(of(all, check).empty()) << check;
  EXPECT_EQ(all["problems"].get<int>() + all["advice"].get<int>() + all["ok"].get<int>(),
            static_cast<int>(all["findings"].size()));
}

TEST(Doctor, missingCamerasAreProblemsAndExitOne) {
  const Outcome o =
      run_vergence("doctor '" + kConfigurations +
                   "gige.yaml' --set cameras.0.serial=NOT-HERE --set cameras.1.serial=NOR-HERE");
  EXPECT_EQ(o.code, 1) << o.out << o.err;
  EXPECT_EQ(o.err, "");
  EXPECT_TRUE(test::mentions(o.out, "NOT-HERE", "receive_buffer"));
  EXPECT_FALSE(contains(o.out, "\033")) << "no colours but on a terminal";
}

TEST(Doctor, connectedCameraAndItsLinkAreEvaluated) {
  test::GigeCameraOptions options{.address = test::GigeCamera::address(61), .serial = "TOOL-61"};
  const test::GigeCamera camera(options);
  const Outcome o = run_vergence(
      "doctor '" + kConfigurations +
      "gige.yaml' --json --set cameras.0.serial=TOOL-61 --set cameras.1.serial=NOR-HERE");
  const json all = json::parse(o.out);
  EXPECT_EQ(of(all, "cameras").size(), 2U) << all.dump(1);
  EXPECT_TRUE(contains(of(all, "cameras").dump(), "cameras.0 (left) is gige TOOL-61"));
  EXPECT_TRUE(contains(of(all, "mtu").dump(), "lo has an MTU of"));
  EXPECT_TRUE(contains(of(all, "camera_network").dump(), options.address + " through lo"));
}

TEST(Doctor, invalidArgumentsExitTwo) {
  EXPECT_EQ(run_vergence("doctor /no/such/file.yaml").code, 2);
  EXPECT_EQ(run_vergence("doctor --set threads=1").code, 2);
  EXPECT_EQ(
      run_vergence("doctor '" + kConfigurations + "gige.yaml' --set cameras.0.options.x=").code, 2);
}

}  // namespace
}  // namespace vergence
