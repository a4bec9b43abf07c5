#include <cstring>

#include "drivers/iidc/iidc_camera.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/unit/drivers/conformance/camera_conformance.hpp"
#include "tests/unit/drivers/iidc/fake_bus.hpp"

namespace vergence::test {
namespace {

/// The camera class over the register model, in real time: the contract without any transport.
class ModelConformance final : public ConformanceRig {
 public:
  ModelConformance() {
    auto bus = std::make_unique<FakeBus>();
    bus_ = bus.get();
    bus_->run();
    const iidc::ConfigRom rom = bus->rom();
    camera_ = std::make_unique<iidc::IidcCamera>(std::move(bus), rom, nullptr,
                                                 Duration::milliseconds(100));
  }

  CameraDevice& camera() override { return *camera_; }
  std::vector<CameraConfiguration> possible() override {
    CameraConfiguration free{160, 120, 50, Duration::milliseconds(4), 0, CameraTrigger::free};
    test::give<iidc::Options>(&free, "buffers", "8");
    CameraConfiguration pulsed = free;
    pulsed.trigger = CameraTrigger::hardware;
    CameraConfiguration asked = free;
    asked.trigger = CameraTrigger::software;
    CameraConfiguration wide = free;
    wide.pixel_format = "Mono16";
    wide.offset_x = 8;
    return {free, pulsed, asked, wide, free};
  }
  std::vector<CameraConfiguration> impossible() override {
    std::vector<CameraConfiguration> all(7, possible().front());
    all[0].width = 161;
    all[1].rate_hz = 200;
    all[1].exposure = Duration::milliseconds(1);
    all[2].exposure = Duration::microseconds(2);
    all[3].gain_db = 60;
    all[4].pixel_format = "Mono9";
    all[5].options = v4l2::Options{};
    all[6].options = iidc::Options{.trigger_source = 4};
    return all;
  }
  std::vector<ExposureSetting> exposures() override {
    return {{Duration::milliseconds(2), 0}, {Duration::milliseconds(8), 6}};
  }
  bool unplug() override {
    bus_->unplug();
    return true;
  }
  void replug() override { bus_->replug(); }
  bool lose(int exposures) override {
    bus_->lose(exposures);
    return true;
  }
  bool content_fits(const Frame&, ImageView image) override {
    // Row y of exposure n is grey level y + n all along, but for what stands in row 0. Mono16
    // repeats it in both bytes.
    for (int y = 2; y < image.height; ++y)
      if (image.at(image.width - 1, y) != static_cast<std::uint8_t>(image.at(0, 1) + y - 1))
        return false;
    return true;
  }

 private:
  FakeBus* bus_ = nullptr;
  std::unique_ptr<iidc::IidcCamera> camera_;
};

}  // namespace

std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t, std::string*) {
  return std::make_unique<ModelConformance>();
}

}  // namespace vergence::test
