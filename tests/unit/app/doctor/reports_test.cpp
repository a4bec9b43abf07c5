#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/doctor/devices_report.hpp"
#include "app/doctor/doctor_report.hpp"
#include "app/runtime/terminal_text.hpp"

namespace vergence::app {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(TerminalText, linesBreakAtBlanksAndNowhereElse) {
  EXPECT_EQ(wrapped("one two  three", 7), (std::vector<std::string>{"one two", "three"}));
  EXPECT_EQ(wrapped("a-word-longer-than-the-line b", 5),
            (std::vector<std::string>{"a-word-longer-than-the-line", "b"}));
  EXPECT_EQ(wrapped("", 5), std::vector<std::string>{""});
  EXPECT_EQ(wrapped("  ", 5), std::vector<std::string>{""});
}

TEST(TerminalText, columnsAreLettersAndNotBytes) {
  EXPECT_EQ(columns("µs °"), 4U);
  EXPECT_EQ(padded("µ", 3), "µ  ");
  EXPECT_EQ(padded("long", 2), "long");
}

TEST(TerminalText, whatADeviceSaysCannotSteerTheTerminal) {
  EXPECT_EQ(harmless("a\033[2J\nb\x7f"), "a [2J b ");
}

std::vector<Finding> findings() {
  return {
      {"receive_buffer",
       FindingState::problem,
       "net.core.rmem_max is too little \033[2J for what this drive asks of it, as anybody can see",
       {"sudo sysctl -w net.core.rmem_max=10485760 # a command longer than the line stays on it, "
        "for it is copied by hand"}},
      {"mtu", FindingState::advice, "larger", {}},
      {"disk", FindingState::ok, "room", {}}};
}

TEST(DoctorReport, aTableThatCanBeReadAndCommandsThatCanBeCopied) {
  const std::string text = doctor_text(findings(), true, {60, false});
  EXPECT_TRUE(contains(text, "problem  receive_buffer     net.core.rmem_max is too little\n"))
      << text;
  EXPECT_TRUE(contains(text,
                       "  sudo sysctl -w net.core.rmem_max=10485760 # a command longer than the "
                       "line stays on it, for it is copied by hand\n"));
  EXPECT_TRUE(contains(text, "1 problem, 1 piece of advice, 1 checked and well.\n"));
  EXPECT_FALSE(contains(text, "\033"));
  EXPECT_FALSE(contains(text, "vergence doctor CONFIG"));
  EXPECT_TRUE(contains(doctor_text({}, false, {60, false}),
                       "No problem, 0 checked and well.\nName a configuration"));
}

TEST(DoctorReport, coloursOnlyWhereTheyAreWelcomeAndOnlyOurs) {
  const std::string text = doctor_text(findings(), true, {100, true});
  EXPECT_TRUE(contains(text, "\033[31;1mproblem"));
  EXPECT_FALSE(contains(text, "\033[2J"));
}

TEST(DoctorReport, programsGetTheSameFindings) {
  const auto all = nlohmann::json::parse(doctor_json(findings()));
  EXPECT_EQ(all["problems"], 1);
  EXPECT_EQ(all["advice"], 1);
  EXPECT_EQ(all["ok"], 1);
  ASSERT_EQ(all["findings"].size(), 3U);
  EXPECT_EQ(all["findings"][0]["check"], "receive_buffer");
  EXPECT_EQ(all["findings"][0]["state"], "problem");
  EXPECT_EQ(all["findings"][0]["mend"].size(), 1U);
  EXPECT_EQ(all["findings"][2]["mend"].size(), 0U);
}

Inventory some_devices() {
  Inventory i;
  DriverFindings gige, v4l2;
  gige.name = "gige";
  gige.cameras = {{{"gige", "1502", "A camera", "10.0.0.2"}, {}, ""}};
  v4l2.name = "v4l2";
  v4l2.note = "/dev/video0: no permission";
  i.drivers = {gige, v4l2};
  FoundPort p;
  p.info = {"/dev/ttyUSB0", "FT232R", 0x0403, 0xD38B, "X\0337", 16};
  p.kind = SerialKind::ins;
  p.configuration = "ins: {driver: xsens, port: /dev/ttyUSB0}";
  i.ports = {p};
  return i;
}

TEST(DevicesReport, saysWhatIsThereWhatToPasteAndWhatIsNot) {
  const std::string text = devices_text(some_devices(), {80, false});
  EXPECT_TRUE(contains(text, "Cameras\n  gige  1502  A camera  10.0.0.2\n")) << text;
  EXPECT_TRUE(contains(text,
                       "  cameras:\n    - {driver: gige, serial: \"1502\"}\n  ins: {driver: xsens, "
                       "port: /dev/ttyUSB0}\n"))
      << text;
  EXPECT_TRUE(contains(text, "Not found\n  v4l2        /dev/video0: no permission\n")) << text;
  EXPECT_FALSE(contains(text, "\033"));
}

TEST(DevicesReport, withoutADeviceOnlySentencesAreLeft) {
  Inventory i;
  i.drivers.resize(1);
  i.drivers[0].name = "v4l2";
  EXPECT_EQ(devices_text(i, {80, false}), "Not found\n  v4l2        none\n  serial      no port\n");
}

TEST(DevicesReport, keysForProgramsStay) {
  const auto all = nlohmann::json::parse(devices_json(some_devices(), ""));
  EXPECT_EQ(all["cameras"][0]["configuration"], "{driver: gige, serial: \"1502\"}");
  const auto& port = all["serial_ports"][0];
  for (const char* key : {"port", "by_id", "kind", "usb_ids", "usb_serial", "description",
                          "latency_timer_ms", "device", "configuration"})
    EXPECT_TRUE(port.contains(key)) << key;
  EXPECT_EQ(port["usb_ids"], "0403:d38b");
  EXPECT_EQ(port["latency_timer_ms"], 16);
  EXPECT_FALSE(all.contains("udev_rules"));
  EXPECT_EQ(nlohmann::json::parse(devices_json({}, "# rules\n"))["udev_rules"], "# rules\n");
}

}  // namespace
}  // namespace vergence::app
