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

TEST(V4l2Settings, nonsenseIsNamed) {
  const auto nonsense = [](auto&& change) {
    CameraConfiguration c = sound();
    change(&c);
    return find_invalid(c);
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

}  // namespace
}  // namespace vergence::v4l2
