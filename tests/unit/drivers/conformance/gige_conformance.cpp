#include "drivers/gige/gige.hpp"

#include "tests/support/camera_options.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/unit/drivers/conformance/camera_conformance.hpp"

namespace vergence::test {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kRate = 50;

/// The project's own GigE camera on the loopback; images carry their number.
class GigeConformance final : public ConformanceRig {
 public:
  explicit GigeConformance(std::uint64_t seed) : simulator_(options(seed)) {
    DeviceStatus status = DeviceStatus::ok;
    const auto driver = gige::make_driver();
    camera_ = driver->open(simulator_.options().address, &status);
    if (camera_ == nullptr)
      throw std::runtime_error("the simulated camera does not open: " + driver->last_error());
  }

  CameraDevice& camera() override { return *camera_; }
  std::vector<CameraConfiguration> possible() override {
    CameraConfiguration free{
        kWidth, kHeight, kRate, Duration::milliseconds(2), 0, CameraTrigger::free};
    CameraConfiguration software = free;
    software.trigger = CameraTrigger::software;
    CameraConfiguration region = free;
    region.width = 96;
    region.offset_x = 32;
    test::give<gige::Options>(&region, "packet_size", "1000");
    CameraConfiguration words = free;
    words.pixel_format = "Mono12";
    return {free, software, region, words, free};
  }
  std::vector<CameraConfiguration> impossible() override {
    std::vector<CameraConfiguration> all(4, possible().front());
    all[0].width = 4096;
    all[1].pixel_format = "RGB8";
    all[2].options = v4l2::Options{};
    all[3].gain_db = 90;
    return all;
  }
  std::vector<ExposureSetting> exposures() override {
    return {{Duration::milliseconds(1), 0}, {Duration::milliseconds(8), 6}};
  }
  bool unplug() override {
    simulator_.unplug();
    return true;
  }
  void replug() override { simulator_.replug(); }
  // The limit covers two unanswered calls and the longest pause.
  Duration disconnected_within() const override { return Duration::seconds(25); }
  bool lose(int exposures) override {
    simulator_.lose_frames(exposures);
    return true;
  }

 private:
  static GigeCameraOptions options(std::uint64_t seed) {
    return {.address = GigeCamera::address(static_cast<int>(seed)),
            .serial = "CONF-" + std::to_string(seed),
            .sensor_width = kWidth,
            .sensor_height = kHeight,
            .first_block = 65'520,
            .extended_ids = seed % 2 == 0,
            .discoverable = false,
            .seed = seed};
  }
  GigeCamera simulator_;
  std::unique_ptr<CameraDevice> camera_;
};

}  // namespace

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t seed) {
  return std::make_unique<GigeConformance>(seed);
}

}  // namespace vergence::test
