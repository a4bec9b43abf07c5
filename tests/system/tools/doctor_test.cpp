#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/gige_camera.hpp"
#include "tests/support/refusal.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::contains;

using nlohmann::json;
using test::Outcome;
using test::run_vergence;

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
  EXPECT_TRUE(mentions(o.out, "NOT-HERE", "receive_buffer"));
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
