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
