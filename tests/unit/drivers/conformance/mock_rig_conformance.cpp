#include "drivers/mock/mock_rig.hpp"
#include "tests/unit/drivers/conformance/camera_conformance.hpp"

namespace vergence::test {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// The mock in real time in an almost empty town; its pulses begin with the first start and go on.
class MockConformance final : public ConformanceRig {
 public:
  explicit MockConformance(std::uint64_t seed) {
    mock::WorldOptions town;
    town.texture_detail = 0;
    town.built_fraction = town.tree_fraction = town.car_fraction = 0;
    RigCalibration calibration;
    calibration.cameras = 1;
    Intrinsics& lens = calibration.intrinsics[0];
    lens.width = kWidth;
    lens.height = kHeight;
    lens.fx = lens.fy = 50;
    lens.cx = 0.5 * (kWidth - 1);
    lens.cy = 0.5 * (kHeight - 1);
    mock::MockRigOptions o;
    o.real_time = true;
    o.seed = seed;
    rig_ = std::make_unique<mock::MockRig>(
        std::make_shared<const mock::RigTruth>(
            std::make_shared<const mock::World>(town), mock::DriveOptions{}, calibration,
            mock::default_T_body_left(), Transform{}, std::vector<mock::Fault>{}),
        o);
  }

  CameraDevice& camera() override { return rig_->camera(0); }
  std::vector<CameraConfiguration> possible() override {
    return {{kWidth, kHeight, 50, Duration::milliseconds(8), 0, CameraTrigger::hardware},
            {kWidth, kHeight, 50, Duration::milliseconds(2), 6, CameraTrigger::hardware}};
  }
  std::vector<CameraConfiguration> impossible() override {
    return {{kWidth * 2, kHeight, 50, Duration::milliseconds(8), 0, CameraTrigger::hardware}};
  }
  void started() override {
    if (pulsing_) return;
    pulsing_ = true;
    (void)rig_->trigger().configure({50}, nullptr);
    (void)rig_->trigger().start(nullptr);
  }
  std::vector<ExposureSetting> exposures() override {
    return {{Duration::milliseconds(4), 0}, {Duration::milliseconds(8), 6}};
  }
  bool counts_from_start() const override { return false; }

 private:
  std::unique_ptr<mock::MockRig> rig_;
  bool pulsing_ = false;
};

}  // namespace

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t seed, std::string* why) {
  (void)why;
  return std::make_unique<MockConformance>(seed);
}

}  // namespace vergence::test
