// V4L2 on the kernel's test camera, inside the rig's kernel (tests/rigs/README.md).
#include <fcntl.h>

#include "drivers/v4l2/v4l2.hpp"
#include "tests/rigs/emulator.hpp"
#include "tests/rigs/vivid.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/unit/drivers/conformance/camera_conformance.hpp"

namespace vergence::test {
namespace {

class V4l2Rig final : public ConformanceRig {
 public:
  explicit V4l2Rig(std::unique_ptr<CameraDevice> camera) : camera_(std::move(camera)) {}

  CameraDevice& camera() override { return *camera_; }

  std::vector<CameraConfiguration> possible() override {
    std::vector<CameraConfiguration> all(3);
    for (CameraConfiguration& c : all) {
      c = {320, 180, 50, Duration::milliseconds(5)};
      c.trigger = CameraTrigger::free;
      test::give<v4l2::Options>(&c, "control_timestamp_source", "Start of Exposure");
    }
    // Images are converted to grey, so the slots are a pool's.
    all[1].pixel_format = "YUYV";
    all[2].width = 640;
    all[2].height = 360;
    test::give<v4l2::Options>(&all[2], "buffers", "8");
    return all;
  }
  std::vector<CameraConfiguration> impossible() override {
    std::vector<CameraConfiguration> all(5, possible().front());
    all[0].width = 322;
    all[1].pixel_format = "Mono12Packed";
    all[2].options = gige::Options{.packet_size = 9000};
    all[3].trigger = CameraTrigger::hardware;
    all[4].gain_db = 3;
    return all;
  }
  bool unplug() override {
    // The test camera comes back by itself when its last handle is closed: this one is the cable.
    cable_.reset(::open(camera_->info().place.c_str(), O_RDWR | O_CLOEXEC));
    set_control(camera_->info().place, "disconnect");
    return true;
  }
  void replug() override { cable_.reset(); }

 private:
  std::unique_ptr<CameraDevice> camera_;
  UniqueFd cable_;
};

}  // namespace

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t) {
  if (!inside_rig()) return nullptr;
  DeviceStatus status = DeviceStatus::ok;
  auto camera = v4l2::make_driver()->open("", &status);
  if (camera == nullptr)
    throw std::runtime_error("the first video node does not open: " +
                             std::string(to_string(status)));
  return std::make_unique<V4l2Rig>(std::move(camera));
}

}  // namespace vergence::test
