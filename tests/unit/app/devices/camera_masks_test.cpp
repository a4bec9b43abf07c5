#include "app/devices/camera_masks.hpp"

#include <opencv2/imgcodecs.hpp>

#include "tests/support/parallel_rig.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 80, kHeight = 60;

RigCalibration small_rig() { return test::parallel_rig(test::pinhole(kWidth, kHeight, 50), 0.5); }

std::string pgm(const std::string& head, char value = 1) {
  return head + std::string(kWidth * kHeight, value);
}

/// The message with which a mask of camera 1 is refused.
std::string refusal(const std::filesystem::path& folder, const std::string& name) {
  Configuration c{.folder = folder};
  c.cameras[1].mask = name;
  return test::refusal_of([&] { const CameraMasks masks(c, small_rig()); });
}

TEST(CameraMasks, pngAndPgmBesideConfigurationAreRead) {
  const test::TemporaryFolder folder;
  cv::Mat drawn(kHeight, kWidth, CV_8UC3, cv::Scalar(255, 255, 255));
  drawn.rowRange(50, 60).setTo(cv::Scalar(0, 0, 0));
  ASSERT_TRUE(cv::imwrite((folder / "bonnet.png").string(), drawn));
  std::string dots = pgm("P5\n# drawn by hand\n80 60 255\n");
  dots[dots.size() - 1] = '\0';
  (void)folder.write("dots.pgm", dots);
  Configuration c{.folder = folder.path()};
  c.cameras[0].mask = "bonnet.png";
  c.cameras[1].mask = (folder / "dots.pgm").string();
  const CameraMasks masks(c, small_rig());
  const auto views = masks.views();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_EQ(views[0].at(x, y) == 0, y >= 50);
      EXPECT_EQ(views[1].at(x, y) == 0, y == kHeight - 1 && x == kWidth - 1);
    }
  EXPECT_TRUE(views[2].empty());
}

TEST(CameraMasks, unusableMasksAreRefused) {
  const test::TemporaryFolder folder;
  (void)folder.write("small.pgm", "P5 40 30 255\n" + std::string(40 * 30, '\1'));
  (void)folder.write("truncated.pgm", pgm("P5 80 60 255\n").substr(0, 1000));
  (void)folder.write("black.pgm", pgm("P5 80 60 255\n", '\0'));
  (void)folder.write("text.pgm", "P2 80 60 255\n0 0 0");
  (void)folder.write("huge.pgm", "P5 99999999999999999999 60 255\n");
  (void)folder.write("headless.pgm", "P5");
  ASSERT_TRUE(cv::imwrite((folder / "photo.jpg").string(),
                          cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(255))));
  const std::string at = "cameras.1.mask: " + folder.path().string() + "/";
  for (const auto& [name, why] :
       {std::pair{"small.pgm", "is 40 × 30 px, but the camera's images are 80 × 60 px"},
        std::pair{"truncated.pgm", "is truncated or damaged"},
        std::pair{"black.pgm", "is 0 everywhere"},
        std::pair{"text.pgm", "is not a mask; use a PNG"}, std::pair{"huge.pgm", "is not a mask"},
        std::pair{"headless.pgm", "is truncated or damaged"},
        std::pair{"photo.jpg", "is not a mask"}})
    EXPECT_TRUE(refusal(folder.path(), name).starts_with(at + name + " " + why))
        << refusal(folder.path(), name);
  EXPECT_EQ(refusal(folder.path(), "nowhere.png"), "cameras.1.mask: nowhere.png is missing");
}

}  // namespace
}  // namespace vergence::app
