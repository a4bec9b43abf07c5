#include "drivers/v4l2/controls.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "drivers/v4l2/settings.hpp"

namespace vergence::v4l2 {
namespace {

Control menu(std::vector<std::pair<std::int64_t, std::string>> items) {
  Control c;
  c.type = V4L2_CTRL_TYPE_MENU;
  c.least = items.front().first;
  c.most = items.back().first;
  c.menu = std::move(items);
  return c;
}

Control integer(std::int64_t least, std::int64_t most, std::int64_t step) {
  Control c;
  c.type = V4L2_CTRL_TYPE_INTEGER;
  c.least = least;
  c.most = most;
  c.step = step;
  return c;
}

TEST(V4l2Controls, namesBecomeKeys) {
  EXPECT_EQ(key_of("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(key_of("  Trigger (Mode) "), "trigger_mode");
  EXPECT_EQ(key_of("S-Video 000-0"), "s_video_000_0");
  EXPECT_EQ(key_of("µ"), "");
}

TEST(V4l2Controls, valueIsANumberInRangeOrAMenuItem) {
  std::int64_t value = -1;
  const Control c = menu({{0, "manual_mode"}, {3, "aperture_priority_mode"}});
  EXPECT_TRUE(parse_value(c, "Aperture Priority Mode", &value));
  EXPECT_EQ(value, 3);
  EXPECT_TRUE(parse_value(c, "0", &value));
  EXPECT_EQ(value, 0);
  EXPECT_FALSE(parse_value(c, "auto", &value));
  EXPECT_FALSE(parse_value(c, "4", &value));
  const Control i = integer(-10, 10, 1);
  EXPECT_TRUE(parse_value(i, "-10", &value));
  EXPECT_EQ(value, -10);
  for (const char* bad : {"11", "", "1x", " 1", "1.5", "99999999999999999999"})
    EXPECT_FALSE(parse_value(i, bad, &value)) << bad;
  EXPECT_EQ(value, -10) << "a refusal changes nothing";
}

TEST(V4l2Controls, clampedValuesLieOnTheGrid) {
  const Control c = integer(3, 103, 10);
  EXPECT_EQ(clamped(c, -5), 3);
  EXPECT_EQ(clamped(c, 7), 3);
  EXPECT_EQ(clamped(c, 8), 13);
  EXPECT_EQ(clamped(c, 1000), 103);
  EXPECT_EQ(clamped(integer(5, 1, 1), 3), 5) << "a driver whose range is empty";
}

TEST(V4l2Controls, externalTriggerIsFoundByMenuNames) {
  EXPECT_EQ(trigger_on(menu({{0, "off"}, {1, "software"}, {2, "external_edge"}})), 2);
  EXPECT_EQ(trigger_on(menu({{0, "free_running"}, {1, "hardware"}})), 1);
  EXPECT_EQ(trigger_on(menu({{0, "off"}, {1, "on"}})), 1);
  EXPECT_EQ(trigger_on(integer(0, 1, 1)), 1);
}

TEST(V4l2Settings, exposureWithoutUnitsCannotBeChanged) {
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

}  // namespace
}  // namespace vergence::v4l2
