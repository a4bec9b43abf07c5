#include "drivers/v4l2/settings.hpp"

#include <gtest/gtest.h>

namespace vergence::v4l2 {
namespace {

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
