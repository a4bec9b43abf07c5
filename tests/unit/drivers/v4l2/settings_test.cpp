#include "drivers/v4l2/settings.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace vergence::v4l2 {
namespace {

CameraConfiguration sound() {
  CameraConfiguration c{640, 480, 20, Duration::milliseconds(5)};
  c.trigger = CameraTrigger::free;
  return c;
}

TEST(V4l2Settings, soundNumbersAreNotNonsense) { EXPECT_EQ(find_nonsense(sound()), ""); }

TEST(V4l2Settings, nonsenseIsNamed) {
  const auto nonsense = [](auto&& change) {
    CameraConfiguration c = sound();
    change(&c);
    return find_nonsense(c);
  };
  EXPECT_NE(nonsense([](auto* c) { c->width = 0; }).find("0 x 480"), std::string::npos);
  EXPECT_NE(nonsense([](auto* c) { c->rate_hz = std::numeric_limits<double>::quiet_NaN(); }), "");
  EXPECT_NE(nonsense([](auto* c) { c->rate_hz = -1; }), "");
  EXPECT_NE(nonsense([](auto* c) { c->exposure = {}; }), "");
  EXPECT_NE(nonsense([](auto* c) { c->exposure = Duration::milliseconds(51); }), "")
      << "longer than the 50 ms between two images";
  EXPECT_NE(nonsense([](auto* c) { c->offset_y = -1; }), "");
  EXPECT_NE(nonsense([](auto* c) { c->gain_db = std::numeric_limits<double>::infinity(); }), "");
}

TEST(V4l2Settings, aCameraWithoutAnExposureInUnitsCannotBeAskedForAnother) {
  ExposureSetting actual{Duration::milliseconds(3), 1};
  EXPECT_EQ(change_exposure(Controls{}, Settings{}, {Duration::milliseconds(2), 0}, &actual),
            DeviceStatus::unsupported);
  Settings lost;
  lost.exposure_id = 0x009a0902;
  lost.exposure_unit_s = 1e-4;
  EXPECT_EQ(change_exposure(Controls{}, lost, {Duration::milliseconds(2), 0}, &actual),
            DeviceStatus::unsupported);
  EXPECT_EQ(actual, (ExposureSetting{Duration::milliseconds(3), 1}));
}

TEST(V4l2Settings, optionsAreReadIntoTheirTypes) {
  CameraConfiguration c = sound();
  c.options = {{"readout_us", "12500.5"}, {"thin", "4"},
               {"buffers", "8"},          {"shift", "2"},
               {"gain_step_db", "0.3"},   {"trigger_control", "Trigger Mode"},
               {"trigger_value", "2"},    {"control_Test Pattern", "100% Black"}};
  Options o;
  std::string error;
  ASSERT_TRUE(parse_options(c, &o, &error)) << error;
  EXPECT_EQ(o.readout, Duration::nanoseconds(12'500'500));
  EXPECT_EQ(o.thin, 4);
  EXPECT_EQ(o.buffers, 8);
  EXPECT_EQ(o.shift, 2);
  EXPECT_EQ(o.gain_step_db, 0.3);
  EXPECT_EQ(o.trigger_control, "trigger_mode");
  ASSERT_EQ(o.controls.size(), 1U);
  EXPECT_EQ(o.controls[0].first, "test_pattern");
  EXPECT_EQ(o.controls[0].second, "100% Black");
}

TEST(V4l2Settings, aWrongOptionIsRefusedWithASentence) {
  const std::pair<const char*, const char*> wrong[] = {
      {"readout_us", "-1"},  {"readout_us", "fast"},  {"thin", "0"},     {"buffers", "3"},
      {"buffers", "33"},     {"buffers", "8.5"},      {"shift", "9"},    {"shift", ""},
      {"gain_step_db", "0"}, {"gain_step_db", "nan"}, {"packet", "9000"}};
  for (const auto& [key, value] : wrong) {
    CameraConfiguration c = sound();
    c.options = {{key, value}};
    Options o;
    std::string error;
    EXPECT_FALSE(parse_options(c, &o, &error)) << key << " " << value;
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_EQ(o.buffers, Options().buffers) << "a refusal changes nothing";
  }
}

}  // namespace
}  // namespace vergence::v4l2
