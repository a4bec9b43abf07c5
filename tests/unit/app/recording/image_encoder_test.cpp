#include "app/recording/image_encoder.hpp"

#include <gtest/gtest.h>

#include <random>

#include "app/datasets/detail/ros_messages.hpp"
#include "app/datasets/image_file.hpp"
#include "app/recording/messages.hpp"
#include "app/recording/png_encoder.hpp"
#include "core/memory/allocation_guard.hpp"
#include "tests/support/recording_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using test::TemporaryFolder;

constexpr int kWidth = 160, kHeight = 120;

Recording::Options recording_options() {
  Recording::Options o;
  o.files.topics = {{"/left/image_raw/compressed", RosType::compressed_image, false}};
  o.queues = {1U << 20U};
  o.when_full = Recording::WhenFull::wait;
  return o;
}

ImageEncoder::Options encoder_options() {
  ImageEncoder::Options o;
  o.waiting = 100'000;
  o.when_full = Recording::WhenFull::wait;
  return o;
}

/// Each image has a grey value of its own, and its columns.
std::vector<std::uint8_t> pixels(int number) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(kWidth) * kHeight);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<std::uint8_t>(static_cast<std::size_t>(number) + i % kWidth);
  return out;
}

TEST(ImageEncoder, imagesAreInTheRecordingInOrderAndPixelForPixel) {
  const TemporaryFolder folder;
  Recording recording(folder.path(), recording_options());
  ImageEncoder encoder(recording, encoder_options());
  constexpr int kImages = 40;  // several times what may wait
  for (int i = 0; i < kImages; ++i) {
    const auto image = pixels(i);
    std::uint32_t crc = 0;
    ASSERT_TRUE(
        encoder.post(0, Stamp(1000 + i), "left", {image.data(), kWidth, kHeight, kWidth}, &crc));
    EXPECT_EQ(crc, crc32_of(image));
  }
  encoder.close();
  recording.close();
  EXPECT_EQ(encoder.dropped(), 0U);
  const auto file = test::read_mcap(folder / "drive.mcap");
  ASSERT_EQ(file.messages.size(), static_cast<std::size_t>(kImages));
  for (int i = 0; i < kImages; ++i) {
    const std::string& content = file.messages[static_cast<std::size_t>(i)].content;
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
    const auto image = detail::read_ros_compressed_image(
        bytes.first(std::min(bytes.size(), detail::kRosImageHead)), bytes.size(),
        detail::MessageEncoding::cdr);
    ASSERT_TRUE(image) << i;
    EXPECT_EQ(image->stamp, Stamp(1000 + i));
    std::vector<std::uint8_t> out(static_cast<std::size_t>(kWidth) * kHeight);
    ASSERT_EQ(decode_grey(bytes.subspan(image->offset, image->bytes), {kWidth, kHeight}, out.data(),
                          kWidth),
              ImageFileStatus::ok);
    EXPECT_EQ(out, pixels(i)) << i;
  }
}

TEST(ImageEncoder, anImageWithoutRoomIsDroppedAndCounted) {
  const TemporaryFolder folder;
  Recording recording(folder.path(), recording_options());
  ImageEncoder::Options o = encoder_options();
  o.waiting = kWidth * kHeight / 2;
  o.when_full = Recording::WhenFull::drop;
  ImageEncoder encoder(recording, o);
  const auto image = pixels(0);
  std::uint32_t crc = 0;
  EXPECT_FALSE(encoder.post(0, Stamp(1), "left", {image.data(), kWidth, kHeight, kWidth}, &crc));
  EXPECT_EQ(encoder.dropped(), 1U);
}

TEST(ImageEncoder, postingTakesNoMemory) {
  if (!AllocationGuard::available()) GTEST_SKIP() << "no allocation hooks in this build";
  const TemporaryFolder folder;
  Recording recording(folder.path(), recording_options());
  ImageEncoder encoder(recording, encoder_options());
  const auto image = pixels(3);
  const auto before = AllocationGuard::allocations_after_seal();
  {
    const SealedScope sealed;
    std::uint32_t crc = 0;
    for (int i = 0; i < 50; ++i)
      (void)encoder.post(0, Stamp(i), "left", {image.data(), kWidth, kHeight, kWidth}, &crc);
  }
  encoder.close();
  recording.close();
  EXPECT_EQ(AllocationGuard::allocations_after_seal() - before, 0U);
}

/// Rows with `padding` bytes behind each that are no part of the image.
struct Image {
  Image(int width, int height, int padding, int noise) : stride(width + padding) {
    std::mt19937 random(7);
    pixels.resize(static_cast<std::size_t>(stride * height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < stride; ++x)
        pixels[static_cast<std::size_t>(y * stride + x)] = static_cast<std::uint8_t>(
            x + 3 * y + static_cast<int>(random() % static_cast<unsigned>(noise + 1)));
    view = {pixels.data(), width, height, stride};
  }
  int stride;
  std::vector<std::uint8_t> pixels{};
  ImageView view{};
};

void expect_same_after_decoding(const ImageView& image, std::span<const std::uint8_t> file) {
  ImageSize size;
  ASSERT_EQ(check_image(file, &size), ImageFileStatus::ok) << "chunks and their check sums";
  ASSERT_EQ(size, (ImageSize{image.width, image.height}));
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<std::uint8_t> out(width * static_cast<std::size_t>(image.height));
  ASSERT_EQ(decode_grey(file, size, out.data(), width), ImageFileStatus::ok);
  for (int y = 0; y < image.height; ++y)
    ASSERT_TRUE(std::equal(image.row(y), image.row(y) + image.width,
                           out.begin() + static_cast<std::ptrdiff_t>(y) * image.width))
        << "row " << y;
}

TEST(PngEncoder, anImageComesBackPixelForPixel) {
  std::vector<std::uint8_t> file;
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {9, 1}, {64, 48}, {333, 77}})
    for (const int noise : {0, 3, 255}) {
      const Image image(width, height, 5, noise);
      ASSERT_TRUE(encode_png(image.view, &file)) << width << " x " << height << ", noise " << noise;
      expect_same_after_decoding(image.view, file);
    }
  EXPECT_FALSE(encode_png({}, &file));
}

TEST(PngEncoder, aSmoothImageIsSmall) {
  std::vector<std::uint8_t> file;
  ASSERT_TRUE(encode_png(Image(320, 240, 0, 0).view, &file));
  EXPECT_LT(file.size(), 320U * 240U / 20U);
}

}  // namespace
}  // namespace vergence::app
