#include "app/publish/frame_images.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "app/datasets/image_file.hpp"
#include "app/publish/live_page.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 960, kHeight = 720;

class Images : public testing::Test {
 protected:
  Images() : pixels_(static_cast<std::size_t>(kWidth * kHeight)) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        pixels_[static_cast<std::size_t>(y * kWidth + x)] = static_cast<std::uint8_t>(x / 4);
    frame_.number = 9;
    frame_.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k)
      frame_.images[k] = {pixels_.data(), kWidth, kHeight, kWidth};
  }

  std::vector<std::uint8_t> pixels_;
  RigFrame frame_{};
  FrameImages images_;
};

TEST_F(Images, areCopiedOnceWhenWantedWithoutHeap) {
  EXPECT_FALSE(images_.copy(frame_)) << "not wanted";
  images_.want(pixels_.size());
  const SealedScope sealed;
  const auto before = AllocationGuard::runtime_allocations();
  EXPECT_TRUE(images_.copy(frame_));
  EXPECT_TRUE(images_.copying());
  EXPECT_FALSE(images_.ready()) << "before finish()";
  images_.finish();
  EXPECT_TRUE(images_.ready());
  EXPECT_EQ(images_.frame(), 9U);
  EXPECT_EQ(images_.image(1).at(957, 700), 957 / 4);
  images_.want(pixels_.size());
  frame_.number = 10;
  EXPECT_FALSE(images_.copy(frame_)) << "it is the reader's until done()";
  images_.done();
  images_.want(pixels_.size());
  frame_.cameras = 1;
  EXPECT_TRUE(images_.copy(frame_));
  EXPECT_EQ(images_.frame(), 10U);
  EXPECT_TRUE(images_.image(1).empty());
  EXPECT_EQ(AllocationGuard::runtime_allocations(), before);
}

TEST_F(Images, thumbnailIsASmallJpeg) {
  const std::string jpeg = thumbnail(frame_.images[0]);
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(jpeg.data()), jpeg.size());
  ImageSize size;
  ASSERT_EQ(read_image_size(bytes, &size), ImageFileStatus::ok);
  EXPECT_EQ(size.width, 480);
  EXPECT_EQ(size.height, 360);
  std::vector<std::uint8_t> grey(480 * 360);
  ASSERT_EQ(decode_grey(bytes, size, grey.data(), 480), ImageFileStatus::ok);
  for (int x = 0; x < 480; x += 37)
    EXPECT_NEAR(grey[static_cast<std::size_t>(180 * 480 + x)], x / 2, 4) << x;
}

TEST_F(Images, largerImagesAreLeftOut) {
  images_.want(pixels_.size() - 1);
  EXPECT_TRUE(images_.copy(frame_));
  EXPECT_TRUE(images_.image(0).empty());
}

TEST(Base64, vectorsOfRfc4648) {
  for (const auto& [text, code] :
       {std::pair{"", ""}, std::pair{"f", "Zg=="}, std::pair{"fo", "Zm8="},
        std::pair{"foo", "Zm9v"}, std::pair{"foobar", "Zm9vYmFy"}})
    EXPECT_EQ(base64(text), code);
}

}  // namespace
}  // namespace vergence::app
