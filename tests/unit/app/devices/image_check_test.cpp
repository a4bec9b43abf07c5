#include "app/devices/image_check.hpp"

#include "app/devices/drive_sync.hpp"
#include "app/devices/rig_settings.hpp"
#include "core/math/random.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

using test::contains;

/// A picture with padded rows, so that whoever takes the stride for the width is found out.
struct TestImage {
  TestImage(int w, int h, std::uint8_t grey)
      : width(w), height(h), pixels(static_cast<std::size_t>((w + 13) * h), 255) {
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) at(x, y) = grey;
  }
  std::uint8_t& at(int x, int y) { return pixels[static_cast<std::size_t>(y * (width + 13) + x)]; }
  [[nodiscard]] ImageView view() const { return {pixels.data(), width, height, width + 13}; }
  int width, height;
  std::vector<std::uint8_t> pixels;
};

/// Random squares of 8 px.
TestImage squares(int w, int h) {
  constexpr int kSquare = 8;
  Random random(1);
  const int columns = w / kSquare + 1, rows = h / kSquare + 1;
  std::vector<std::uint8_t> levels;
  for (int i = 0; i < columns * rows; ++i)
    levels.push_back(static_cast<std::uint8_t>(40 + random.below(170)));
  TestImage p(w, h, 0);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      p.at(x, y) = levels[static_cast<std::size_t>(y / kSquare * columns + x / kSquare)];
    }
  return p;
}

std::vector<ImageIssue> issues_of(const std::vector<TestImage>& images) {
  static const std::vector<std::string> kNames{"left", "right", "middle"};
  std::vector<ImageStatistics> statistics;
  for (const TestImage& p : images) statistics.push_back(image_statistics(p.view()));
  return evaluate_images(std::span(kNames).first(images.size()), statistics);
}

TEST(ImageStatistics, excludePadding) {
  TestImage p(4, 4, 100);
  const ImageStatistics flat = image_statistics(p.view());
  EXPECT_DOUBLE_EQ(flat.mean, 100);
  EXPECT_DOUBLE_EQ(flat.contrast, 0);
  EXPECT_DOUBLE_EQ(flat.saturated, 0);
  EXPECT_DOUBLE_EQ(flat.dark, 0);
  EXPECT_DOUBLE_EQ(flat.sharpness, 0);
  for (int y = 0; y < 4; ++y) p.at(2, y) = p.at(3, y) = 254;
  p.at(0, 0) = 4;
  const ImageStatistics f = image_statistics(p.view());
  EXPECT_DOUBLE_EQ(f.mean, (7 * 100 + 8 * 254 + 4) / 16.0);
  EXPECT_DOUBLE_EQ(f.saturated, 0.5);
  EXPECT_DOUBLE_EQ(f.dark, 1 / 16.0);
  EXPECT_DOUBLE_EQ(f.sharpness, 77.0 * 77.0) << "half of 154 in each of the four inner pixels";
}

TEST(ImageCheck, rejectsBlackWhiteAndFlatImages) {
  const auto remarks =
      issues_of({TestImage(320, 240, 2), TestImage(320, 240, 255), TestImage(320, 240, 90)});
  ASSERT_EQ(remarks.size(), 3U);
  EXPECT_TRUE(contains(remarks[0].message, "left is black"));
  EXPECT_TRUE(contains(remarks[1].message, "right is overexposed: 100 %"));
  EXPECT_TRUE(contains(remarks[2].message, "middle is one uniform grey"));
  for (const ImageIssue& r : remarks) EXPECT_TRUE(r.unusable);
}

TEST(ImageCheck, detectsOneDefocusedCamera) {
  const TestImage sharp = squares(320, 240);
  TestImage blurred = sharp;
  // With this radius in px, three squares run into one.
  constexpr int kRadius = 12;
  for (int y = 0; y < 240; ++y)
    for (int x = kRadius; x + kRadius < 320; ++x) {
      int sum = 0;
      for (int u = -kRadius; u <= kRadius; ++u) sum += sharp.view().at(x + u, y / 8 * 8);
      blurred.at(x, y) = static_cast<std::uint8_t>(sum / (2 * kRadius + 1));
    }
  // Then blur across the rows.
  for (int x = 0; x < 320; ++x)
    for (int y = 0; y < 240; ++y) blurred.at(x, y) = blurred.at(x, y / 48 * 48);
  const auto remarks = issues_of({sharp, blurred});
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_FALSE(remarks[0].unusable);
  EXPECT_TRUE(test::mentions(remarks[0].message, "right is much less sharp than left"));
}

TEST(ImageFileNames, cameraNamesGiveFileNames) {
  Configuration c;
  c.cameras[0].name = "../left eye";
  c.cameras[2].name = "camera1";
  EXPECT_EQ(camera_names(c, 3), (std::vector<std::string>{"___left_eye", "camera1", "camera1_1"}));
}

Configuration example(const std::string& name) {
  return load_configuration(VERGENCE_SOURCE_DIR "/app/config/" + name, {});
}

TEST(CaptureSettings, keepsTriggeringIns) {
  const Configuration c = capture_configuration(example("ins_syncout.yaml"));
  EXPECT_EQ(c.ins.driver, "xsens");
  EXPECT_EQ(sync_options(c, 2).mode, SyncMode::ins_syncout) << "as the user's file is, it works";
}

TEST(CaptureSettings, omitsUnneededIns) {
  const Configuration given = example("mock.yaml");
  ASSERT_EQ(given.ins.driver, "mock");
  EXPECT_EQ(capture_configuration(given).ins.driver, "none");
}

}  // namespace
}  // namespace vergence::app
