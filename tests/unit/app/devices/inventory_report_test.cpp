#include "app/devices/inventory_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/app/devices/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::contains;

TEST(DoctorReport, commandsStayWholeAndControlCodesAreRemoved) {
  const std::string command = "sudo sysctl -w net.core.rmem_max=10485760 # longer than the line";
  const std::vector<Finding> findings{
      {"receive_buffer", FindingState::problem, "too little \033[2J", {command}},
      {"disk", FindingState::ok, "room", {}}};
  const std::string plain = doctor_text(findings, true, {60, false});
  EXPECT_TRUE(contains(plain, command + "\n")) << plain;
  EXPECT_FALSE(contains(plain, "\033"));
  const std::string coloured = doctor_text(findings, true, {100, true});
  EXPECT_TRUE(contains(coloured, "\033[31;1mproblem"));
  EXPECT_FALSE(contains(coloured, "\033[2J"));
  const auto json = nlohmann::json::parse(doctor_json(findings));
  EXPECT_EQ(json["problems"], 1);
  EXPECT_EQ(json["ok"], 1);
  EXPECT_EQ(json["findings"][0]["check"], "receive_buffer");
  EXPECT_EQ(json["findings"][0]["state"], "problem");
  EXPECT_EQ(json["findings"][0]["fix"].at(0), command);
}

TEST(DevicesReport, controlCodesOfDevicesAreRemoved) {
  Inventory i;
  i.ports = {test::port(0x0403, 0xD38B, "X\0337")};
  EXPECT_FALSE(contains(devices_text(i, {80, false}), "\033"));
}

TEST(DevicesReport, cameraLineIsYamlForAnySerial) {
  EXPECT_EQ(camera_line({"gige", "", "", "10.0.0.2"}), "{driver: gige, serial: \"10.0.0.2\"}");
  EXPECT_EQ(camera_line({"v4l2", "a\"b\\\n\xff", "", ""}),
            "{driver: v4l2, serial: \"a\\\"b\\\\\\n\\ufffd\"}");
}

}  // namespace
}  // namespace vergence::app
