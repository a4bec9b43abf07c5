#include "app/publish/live_page.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "app/datasets/image_file.hpp"
#include "core/memory/allocation_guard.hpp"
#include "core/memory/arena.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 960, kHeight = 720;

class Images : public testing::Test {
 protected:
  Images() : pixels_(static_cast<std::size_t>(kWidth * kHeight)) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        pixels_[static_cast<std::size_t>(y * kWidth + x)] = static_cast<std::uint8_t>(x / 4);
    images_->reserve(pixels_.size());
    frame_.number = 9;
    frame_.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k)
      frame_.images[k] = {pixels_.data(), kWidth, kHeight, kWidth};
    calibration::LoggedFrame logged;
    logged.number = 9;
    tracks_.begin(logged);
    calibration::LoggedObservation o;
    o.cameras = 3;
    o.raw[0] = {500, 300};
    o.raw[1] = {465, 300};
    tracks_.push(o);
    o.cameras = 2;  // not the left one's
    tracks_.push(o);
  }

  std::vector<std::uint8_t> pixels_;
  RigFrame frame_{};
  Arena arena_{calibration::TrackLog::memory_needed(2, 10) + 4096};
  calibration::TrackLog tracks_{2, 10, arena_};
  std::unique_ptr<LiveImages> images_ = std::make_unique<LiveImages>();
};

TEST_F(Images, areTakenOnceWhenSomebodyWantsThemWithoutMemory) {
  const SealedScope sealed;
  const auto before = AllocationGuard::runtime_allocations();
  images_->take_images(frame_);
  images_->take_points(frame_, tracks_);
  EXPECT_FALSE(images_->ready()) << "nobody asked";
  images_->want();
  images_->take_images(frame_);
  EXPECT_FALSE(images_->ready()) << "its points are still to come";
  images_->take_points(frame_, tracks_);
  EXPECT_TRUE(images_->ready());
  EXPECT_EQ(images_->frame(), 9U);
  ASSERT_EQ(images_->points().size(), 1U);
  EXPECT_TRUE(images_->points()[0].both);
  images_->want();
  frame_.number = 10;
  images_->take_images(frame_);
  EXPECT_EQ(images_->frame(), 9U) << "it belongs to the viewer until done()";
  images_->done();
  images_->want();
  images_->take_images(frame_);
  images_->take_points(frame_, tracks_);
  EXPECT_TRUE(images_->points().empty()) << "the tracks are of frame 9";
  EXPECT_EQ(AllocationGuard::runtime_allocations(), before);
}

TEST_F(Images, aThumbnailIsASmallJpegOfTheImage) {
  images_->want();
  images_->take_images(frame_);
  images_->take_points(frame_, tracks_);
  const std::string jpeg = thumbnail(images_->pictures()[0]);
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(jpeg.data()), jpeg.size());
  ImageSize size;
  ASSERT_EQ(check_image(bytes, &size), ImageFileStatus::ok);
  EXPECT_EQ(size.width, 480);
  EXPECT_EQ(size.height, 360);
  std::vector<std::uint8_t> grey(480 * 360);
  ASSERT_EQ(decode_grey(bytes, size, grey.data(), 480), ImageFileStatus::ok);
  for (int x = 0; x < 480; x += 37)
    EXPECT_NEAR(grey[static_cast<std::size_t>(180 * 480 + x)], x / 2, 4) << x;
}

TEST_F(Images, anImageOfAnotherSizeThanTheRigsIsLeftOut) {
  images_->reserve(pixels_.size() / 4);
  images_->want();
  images_->take_images(frame_);
  images_->take_points(frame_, tracks_);
  ASSERT_TRUE(images_->ready());
  EXPECT_EQ(images_->pictures()[0].width, 0);
  EXPECT_TRUE(thumbnail(images_->pictures()[0]).empty() || images_->pictures()[0].width > 0);
}

TEST(Base64, knownAnswersOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace vergence::app
