#include "app/capture/taking.hpp"

#include <gtest/gtest.h>

#include <string>

#include "app/devices/drive_sync.hpp"

namespace vergence::app {
namespace {

Configuration example(const std::string& name) {
  return load_configuration(VERGENCE_SOURCE_DIR "/app/config/" + name, {});
}

TEST(CaptureSettings, anInsThatTriggersTheCamerasStays) {
  const Configuration c = capture_configuration(example("ins_syncout.yaml"));
  EXPECT_EQ(c.ins.driver, "xsens");
  EXPECT_EQ(sync_options(c, 2).mode, SyncMode::ins_syncout) << "as the user's file is, it works";
}

TEST(CaptureSettings, anInsThatPicturesDoWithoutIsLeftOut) {
  const Configuration given = example("mock.yaml");
  ASSERT_EQ(given.ins.driver, "mock");
  EXPECT_EQ(capture_configuration(given).ins.driver, "none");
}

}  // namespace
}  // namespace vergence::app
