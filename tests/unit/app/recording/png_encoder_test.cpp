#include "app/recording/png_encoder.hpp"

#include <gtest/gtest.h>

#include <random>

#include "app/datasets/image_file.hpp"

namespace vergence::app {
namespace {

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
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {9, 1}, {64, 48}, {333, 77}}) {
    PngEncoder encoder(333, 77);
    std::vector<std::uint8_t> file(PngEncoder::most_bytes(width, height));
    for (const int noise : {0, 3, 255}) {
      const Image image(width, height, 5, noise);
      const std::size_t size = encoder.encode(image.view, file);
      ASSERT_GT(size, 0U) << width << " x " << height << ", noise " << noise;
      expect_same_after_decoding(image.view, std::span(file).first(size));
    }
  }
}

TEST(PngEncoder, aSmoothImageIsSmallAndNoiseStaysWithinTheBound) {
  PngEncoder encoder(320, 240);
  std::vector<std::uint8_t> file(PngEncoder::most_bytes(320, 240));
  EXPECT_LT(encoder.encode(Image(320, 240, 0, 0).view, file), 320U * 240U / 20U);
  const std::size_t noise = encoder.encode(Image(320, 240, 0, 255).view, file);
  EXPECT_GT(noise, 320U * 240U * 9U / 10U);
  EXPECT_LE(noise, file.size());
}

TEST(PngEncoder, refusesWhatHasNoRoom) {
  PngEncoder encoder(64, 48);
  std::vector<std::uint8_t> file(PngEncoder::most_bytes(64, 49));
  EXPECT_EQ(encoder.encode(Image(64, 49, 0, 0).view, file), 0U) << "larger than it was made for";
  EXPECT_EQ(encoder.encode({}, file), 0U);
  const Image noise(64, 48, 0, 255);
  const std::size_t needed = encoder.encode(noise.view, file);
  for (const std::size_t room : {std::size_t{0}, std::size_t{8}, std::size_t{60}, needed - 1})
    EXPECT_EQ(encoder.encode(noise.view, std::span(file).first(room)), 0U) << room << " bytes";
}

}  // namespace
}  // namespace vergence::app
