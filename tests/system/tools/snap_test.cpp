#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/image_file.hpp"
#include "core/math/random.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::contains;

using nlohmann::json;
using test::GigeCamera;
using test::Outcome;
using test::run_vergence;
using test::TemporaryFolder;

const std::string kConfigurations = std::string(VERGENCE_SOURCE_DIR) + "/app/config/";
constexpr int kWidth = 320, kHeight = 240;

Outcome snap(const TemporaryFolder& folder, const std::string& configuration,
             const std::string& more) {
  return run_vergence("snap '" + kConfigurations + configuration + "' --out '" +
                      (folder / "s").string() + "' " + more);
}
json report(const TemporaryFolder& folder) {
  return json::parse(test::read_file(folder / "s/snap.json"));
}

app::ImageSize size_of(const std::filesystem::path& file) {
  app::ImageSize size;
  EXPECT_EQ(app::read_image_size(file, &size), app::ImageFileStatus::ok) << file;
  return size;
}

TEST(SnapMock, aPictureOfEachCameraAndTheirFigures) {
  const TemporaryFolder folder;
  const Outcome o = snap(folder, "mock.yaml", "");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.err, "");
  for (const char* name : {"left", "right"})
    EXPECT_EQ(size_of(folder / (std::string("s/") + name + ".png")), (app::ImageSize{640, 480}));
  const json set = report(folder)["sets"].at(0);
  EXPECT_EQ(set["proof"], "counted");
  EXPECT_LT(set["spread_ms"].get<double>(), 5);
  EXPECT_TRUE(set["findings"].empty()) << set["findings"];
  for (const json& image : set["images"]) {
    EXPECT_GT(image["mean"], 20);
    EXPECT_GT(image["sharpness"], 1);
    EXPECT_EQ(image["exposure_us"], 8000);
    EXPECT_TRUE(contains(o.out, image["file"]));
  }
}

TEST(SnapMock, aCapOnALensIsNoticed) {
  const TemporaryFolder folder;
  const Outcome o = snap(folder, "mock.yaml", "--set 'faults.0=cover@0 camera=1'");
  EXPECT_EQ(o.code, 1) << o.err;
  EXPECT_TRUE(contains(o.err, "right is black")) << o.err;
  EXPECT_EQ(report(folder)["sets"][0]["findings"][0]["unusable"], true);
}

TEST(SnapMock, nothingIsOverwrittenAndNonsenseIsRefused) {
  const TemporaryFolder folder;
  (void)folder.write("s/precious", "x");
  EXPECT_EQ(snap(folder, "mock.yaml", "").code, 2);
  const TemporaryFolder other;
  for (const char* more : {"--count 0", "--count 10000", "--wait 0", "--wait -1",
                           "--set cameras.5.driver=mock", "--set no.such.key=1"}) {
    const Outcome o = snap(other, "mock.yaml", more);
    EXPECT_EQ(o.code, 2) << more;
    EXPECT_FALSE(std::filesystem::exists(other / "s/snap.json")) << more;
  }
}

/// The two cameras of app/config/gige.yaml, simulated; the second sees the same scene from further
/// right, as it should.
struct Wires {
  Wires() {
    for (int k = 0; k < 2; ++k) {
      scenes.push_back(scene(12 * k));
      test::GigeCameraOptions o;
      o.address = GigeCamera::address(70 + k);
      o.serial = "SNAP-" + std::to_string(k);
      o.sensor_width = kWidth;
      o.sensor_height = kHeight;
      o.number_images = false;
      o.discoverable = false;
      o.images = [pixels = scenes.back().data()](std::uint64_t) { return pixels; };
      cameras.push_back(std::make_unique<GigeCamera>(o));
    }
  }
  static std::vector<std::uint8_t> scene(int shift) {
    constexpr int kSquare = 8;
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        Random level(static_cast<std::uint64_t>((y / kSquare) * 1000 + (x + shift) / kSquare));
        pixels.push_back(static_cast<std::uint8_t>(40 + level.below(150)));
      }
    return pixels;
  }
  [[nodiscard]] std::string settings() const {
    std::string s = "--set trigger.rate=10";
    for (int k = 0; k < 2; ++k) {
      const std::string at = " --set cameras." + std::to_string(k);
      s += at + ".serial=" + cameras[static_cast<std::size_t>(k)]->options().address + at +
           ".size=[320,240]";
    }
    return s;
  }
  std::vector<std::vector<std::uint8_t>> scenes;
  std::vector<std::unique_ptr<GigeCamera>> cameras;
};

TEST(SnapGige, pulsesGivePairsAndThePicturesAreThoseThatWereSent) {
  const Wires wires;
  std::atomic<bool> quit{false};
  std::thread pulses([&] {
    for (std::uint64_t n = 0; !quit; ++n) {
      const HostStamp now(std::chrono::steady_clock::now().time_since_epoch().count());
      for (const auto& camera : wires.cameras) camera->pulse(n, now);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  });
  const TemporaryFolder folder;
  const Outcome o = snap(folder, "gige.yaml", wires.settings());
  quit = true;
  pulses.join();
  ASSERT_EQ(o.code, 0) << o.err;
  const json all = report(folder);
  EXPECT_EQ(all["trigger"], "hardware");
  EXPECT_EQ(all["sets"][0]["images"][1]["serial"], "SNAP-1");
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<std::uint8_t> bytes, pixels(std::size_t{kWidth} * kHeight);
    ASSERT_EQ(app::read_image_file(folder / (k == 0 ? "s/left.png" : "s/right.png"), &bytes),
              app::ImageFileStatus::ok);
    ASSERT_EQ(app::decode_grey(bytes, {kWidth, kHeight}, pixels.data(), kWidth),
              app::ImageFileStatus::ok);
    EXPECT_EQ(pixels, wires.scenes[k]);
  }
}

TEST(SnapGige, aCameraThatSendsNothingEndsWithThreeAndItsName) {
  const Wires wires;
  wires.cameras[1]->silence(true);
  const TemporaryFolder folder;
  const auto begin = std::chrono::steady_clock::now();
  const Outcome o =
      snap(folder, "gige.yaml",
           wires.settings() +
               " --wait 2 --set cameras.0.trigger=software --set cameras.1.trigger=software");
  EXPECT_EQ(o.code, 3) << o.err;
  EXPECT_TRUE(contains(o.err, "right (gige SNAP-1) sent no image within 2 s")) << o.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "s/left.png"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20))
      << "the wait is bounded";
}

}  // namespace
}  // namespace vergence
