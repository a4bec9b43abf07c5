#include <nlohmann/json.hpp>

#include "app/datasets/image_file.hpp"
#include "tests/support/gige_pair.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::contains;

using nlohmann::json;
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

TEST(SnapMock, imageOfEachCameraAndItsStatistics) {
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

TEST(SnapMock, coveredLensIsReportedAndExitsOne) {
  const TemporaryFolder folder;
  const Outcome o = snap(folder, "mock.yaml", "--set 'faults.0=cover@0 camera=1'");
  EXPECT_EQ(o.code, 1) << o.err;
  EXPECT_TRUE(contains(o.err, "right is black")) << o.err;
  EXPECT_EQ(report(folder)["sets"][0]["findings"][0]["unusable"], true);
}

TEST(SnapMock, existingDirectoryAndBadOptionsExitTwo) {
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

/// A scene of random squares, moved by `shift` px.
std::vector<std::uint8_t> scene(int shift) {
  constexpr int kSquare = 8;
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      Random level(static_cast<std::uint64_t>((y / kSquare) * 1000 + (x + shift) / kSquare));
      pixels.push_back(static_cast<std::uint8_t>(40 + level.below(150)));
    }
  return pixels;
}

/// The two cameras of app/config/gige.yaml; the right one sees the same scene from further right.
struct SnapGige : testing::Test {
  std::array<std::vector<std::uint8_t>, 2> shown{scene(0), scene(12)};
  test::GigePair cameras{"SNAP", 70, kWidth, kHeight,
                         [this](std::size_t k, std::uint64_t) { return shown[k].data(); }};
  std::string settings = "--set trigger.rate=10" + cameras.settings();
};

TEST_F(SnapGige, pulsesGivePairsOfTheSentImages) {
  const std::jthread pulses = cameras.pulses(10);
  const TemporaryFolder folder;
  const Outcome o = snap(folder, "gige.yaml", settings);
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
    EXPECT_EQ(pixels, shown[k]);
  }
}

TEST_F(SnapGige, silentCameraIsNamedAndExitsThree) {
  cameras[1].silence(true);
  const TemporaryFolder folder;
  const auto begin = std::chrono::steady_clock::now();
  const Outcome o = snap(
      folder, "gige.yaml",
      settings + " --wait 2 --set cameras.0.trigger=software --set cameras.1.trigger=software");
  EXPECT_EQ(o.code, 3) << o.err;
  EXPECT_TRUE(contains(o.err, "right (gige SNAP-1) sent no image within 2 s")) << o.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "s/left.png"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20))
      << "the wait is bounded";
}

}  // namespace
}  // namespace vergence
