#include "drivers/options/options.hpp"

#include <map>
#include <utility>

#include "tests/support/mentions.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence {
namespace {

/// Options as "name=value" by the name of their driver.
using Texts = std::map<std::string, std::vector<std::string>>;

std::pair<std::string, std::string> split(const std::string& text) {
  const std::size_t at = text.find('=');
  return {text.substr(0, at), text.substr(at + 1)};
}

/// A value of every option that is not its default, sorted by name.
const Texts& other_values() {
  static const Texts all{
      {"gige",
       {"buffers=16", "feature.BlackLevel=3", "link_cameras=2", "link_mbps=1000",
        "packet_delay_us=12.5", "packet_size=1500", "ptp=on", "resend=off", "socket_buffer_kb=8192",
        "stamp_at=end", "trigger_edge=falling", "trigger_line=Line2"}},
      {"iidc-usb",
       {"buffers=32", "embedded=off", "format7=off", "packet_bytes=1024", "speed=800",
        "stamp_at=middle", "strobe_delay_us=1000", "strobe_duration_us=3998", "strobe_level=low",
        "strobe_pin=0", "trigger_edge=falling", "trigger_mode=14", "trigger_source=3"}},
      {"v4l2",
       {"buffers=8", "control_test_pattern=black", "gain_step_db=0.3", "readout_us=12500.5",
        "shift=2", "subdevice=/dev/v4l-subdev3", "thin=4", "trigger_control=trigger_mode",
        "trigger_value=2"}}};
  return all;
}

CameraOptions begin_of(const std::string& driver) { return default_options(driver).value(); }

TEST(CameraOptions, everyRowRoundTripsAsText) {
  for (const auto& [driver, texts] : other_values()) {
    CameraOptions all = begin_of(driver);
    EXPECT_EQ(texts.size(), option_rows(all).size()) << driver;
    EXPECT_EQ(options_text(all), "") << driver;
    std::string expected;
    for (const std::string& text : texts) {
      const auto [name, value] = split(text);
      CameraOptions one = begin_of(driver);
      ASSERT_TRUE(set_option(name, value, &one)) << name;
      EXPECT_EQ(options_text(one), text);
      ASSERT_TRUE(set_option(name, value, &all));
      ASSERT_TRUE(set_option(name, value, &all)) << "twice is once";
      expected += (expected.empty() ? "" : " ") + text;
    }
    EXPECT_EQ(options_text(all), expected) << driver;
  }
}

TEST(CameraOptions, invalidValueChangesNothing) {
  const Texts wrong{
      {"gige",
       {"packet_size=ten", "packet_size=575", "packet_delay_us=nan", "buffers=3",
        "link_cameras=1.5", "resend=perhaps", "trigger_edge=", "trigger_line=", "feature.=1"}},
      {"iidc-usb",
       {"packet_bytes=1022", "buffers=33", "trigger_mode=1", "trigger_source=-1", "speed=fast",
        "embedded=2"}},
      {"v4l2",
       {"readout_us=-1", "thin=0", "buffers=8.5", "shift=", "gain_step_db=0", "packet_size=9000"}}};
  for (const auto& [driver, texts] : wrong)
    for (const std::string& text : texts) {
      const auto [name, value] = split(text);
      CameraOptions o = begin_of(driver);
      EXPECT_FALSE(set_option(name, value, &o)) << text;
      EXPECT_EQ(options_text(o), "") << text;
    }
  CameraOptions none;
  EXPECT_FALSE(set_option("buffers", "8", &none));
  EXPECT_FALSE(default_options("mock").has_value());
}

TEST(CameraOptions, driverTakesOnlyItsKindAndValidValues) {
  gige::Options taken{.buffers = 7};
  std::string error;
  EXPECT_FALSE(
      parse_options(v4l2::Options{}, gige::option_table(), "GigE cameras", &taken, &error));
  EXPECT_TRUE(test::mentions(error, "GigE cameras"));
  EXPECT_FALSE(
      parse_options(gige::Options{.buffers = 3}, gige::option_table(), "", &taken, &error));
  EXPECT_TRUE(test::mentions(error, "buffers takes 4 to 48"));
  EXPECT_EQ(taken.buffers, 7) << "a refusal changes nothing";
  EXPECT_TRUE(parse_options(gige::Options{.buffers = 9}, gige::option_table(), "", &taken, &error));
  EXPECT_EQ(taken.buffers, 9);
  EXPECT_TRUE(parse_options(std::monostate{}, gige::option_table(), "", &taken, &error));
  EXPECT_EQ(taken.buffers, gige::Options{}.buffers);
}

TEST(CameraOptions, documentationHasEveryRow) {
  std::string pages;
  for (const std::string page : {"gige", "iidc", "v4l2"})
    pages += test::read_file(VERGENCE_SOURCE_DIR "/drivers/" + page + "/README.md");
  for (const char* driver : {"gige", "iidc-usb", "v4l2"})
    for (const OptionRow& r : option_rows(begin_of(driver))) {
      const std::string fallback = r.fallback.empty() ? "–" : r.fallback;
      const std::string line =
          "\n| `" + r.name + "` | " + r.values + " | " + fallback + " | " + r.meaning + " |\n";
      EXPECT_TRUE(test::contains(pages, line)) << line;
    }
}

}  // namespace
}  // namespace vergence
