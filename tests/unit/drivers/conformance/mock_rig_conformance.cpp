#include "tests/support/small_mock.hpp"
#include "tests/unit/drivers/conformance/camera_conformance.hpp"

namespace vergence::test {
namespace {

/// The mock in real time in an almost empty town; its pulses begin with the first start and go on.
class MockConformance final : public ConformanceRig {
 public:
  explicit MockConformance(std::uint64_t seed) {
    mock::MockRigOptions o{.real_time = true, .seed = seed};
    rig_ = std::make_unique<mock::MockRig>(small_truth({}, 1, mock::DriveKind::loop), o);
  }

  CameraDevice& camera() override { return rig_->camera(0); }
  std::vector<CameraConfiguration> possible() override {
    CameraConfiguration other = small_camera(50);
    other.exposure = Duration::milliseconds(2);
    other.gain_db = 6;
    return {small_camera(50), other};
  }
  std::vector<CameraConfiguration> impossible() override {
    CameraConfiguration wide = small_camera(50);
    wide.width *= 2;
    return {wide};
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

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t seed) {
  return std::make_unique<MockConformance>(seed);
}

}  // namespace vergence::test
