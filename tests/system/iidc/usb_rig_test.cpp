#include "drivers/iidc/iidc.hpp"
#include "tests/rigs/iidc_rig.hpp"
#include "tests/support/within.hpp"

namespace vergence::test {

struct BusUnderTest {
  static constexpr const char* kEmulator = "sim_usb_iidc";
  static constexpr const char* kSent = "delivered";
  /// A short packet ends the frame, and the next one is complete.
  static constexpr std::uint64_t kLostWithIncomplete = 0;
  static std::unique_ptr<CameraDriver> driver() { return iidc::make_usb_driver(); }
  static void unplug(Emulator* e, unsigned camera) {
    e->command("unplug " + std::to_string(camera));
  }
  static void replug(Emulator* e, unsigned camera) {
    e->command("replug " + std::to_string(camera));
  }
};

}  // namespace vergence::test

#include "tests/system/iidc/rig_cases.hpp"  // NOLINT: after what it is made of

namespace vergence::test {
namespace {

TEST_F(IidcRig, cameraIsOpenedByItsUsbSerial) {
  const Emulator emulator("sim_usb_iidc", {"--cameras", "1"});
  DeviceStatus status = DeviceStatus::failed;
  std::unique_ptr<CameraDevice> camera;
  ASSERT_TRUE(within(5, [&] {
    camera = driver_->open("10240000", &status);
    return camera != nullptr;
  })) << driver_->last_error();
  EXPECT_EQ(camera->info().serial, emulated_serial(0));
}

}  // namespace
}  // namespace vergence::test
