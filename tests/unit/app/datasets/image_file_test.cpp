#include "app/datasets/image_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgproc.hpp>

#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

using test::kTinyHeight;
using test::kTinyWidth;

constexpr ImageSize kSize{kTinyWidth, kTinyHeight};
constexpr std::size_t kStride = 128;

std::vector<std::uint8_t> bytes_of(const std::filesystem::path& file) {
  std::vector<std::uint8_t> bytes;
  EXPECT_EQ(read_image_file(file, &bytes), ImageFileStatus::ok);
  return bytes;
}

ImageFileStatus decode(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> out(kStride * kTinyHeight);
  return decode_grey(bytes, kSize, out.data(), kStride);
}

class ImageFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name) {
    test::write_tiny_image(folder_ / name, 5);
    return folder_ / name;
  }
  test::TemporaryFolder folder_;
};

TEST_F(ImageFile, pngIsDecodedToTheBitIntoPaddedRowsAndPaddingIsLeftAlone) {
  const auto bytes = bytes_of(write("a.png"));
  std::vector<std::uint8_t> out(kStride * kTinyHeight, 77);
  ASSERT_EQ(decode_grey(bytes, kSize, out.data(), kStride), ImageFileStatus::ok);
  for (int y = 0; y < kTinyHeight; ++y)
    for (int x = 0; x < static_cast<int>(kStride); ++x)
      ASSERT_EQ(out[static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x)], x < kTinyWidth ? test::tiny_pixel(x, y, 5) : 77)
          << x << " " << y;
}

TEST_F(ImageFile, colourAndSixteenBitAreReadAsGrey) {
  cv::Mat grey(kTinyHeight, kTinyWidth, CV_8UC1, cv::Scalar(90)), deep(kTinyHeight, kTinyWidth, CV_16UC1, cv::Scalar(90 * 257)), colour;
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
  cv::imwrite((folder_ / "colour.png").string(), colour);
  cv::imwrite((folder_ / "deep.png").string(), deep);
  for (const char* name : {"colour.png", "deep.png"}) {
    std::vector<std::uint8_t> out(kStride * kTinyHeight);
    ASSERT_EQ(decode_grey(bytes_of(folder_ / name), kSize, out.data(), kStride), ImageFileStatus::ok) << name;
    EXPECT_NEAR(out[3 * kStride + 7], 90, 1) << name;
  }
}

TEST_F(ImageFile, jpegIsDecoded) { EXPECT_EQ(decode(bytes_of(write("a.jpg"))), ImageFileStatus::ok); }

TEST_F(ImageFile, everyTruncationIsTorn) {
  for (const char* name : {"a.png", "a.jpg"}) {
    const auto whole = bytes_of(write(name));
    ASSERT_EQ(decode(whole), ImageFileStatus::ok);
    for (std::size_t n = 0; n < whole.size(); n += n < 200 ? 1 : 37) {
      const std::vector<std::uint8_t> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
      // Of a few bytes nobody can say what they were to become.
      const ImageFileStatus status = decode(part);
      EXPECT_TRUE(status == ImageFileStatus::torn || (n < 8 && status == ImageFileStatus::not_an_image)) << name << " cut at " << n;
    }
    auto lacks_one = whole;
    lacks_one.pop_back();
    EXPECT_EQ(decode(lacks_one), ImageFileStatus::torn) << name;
  }
}

TEST_F(ImageFile, aFlippedBitInThePixelsOfAPngIsTorn) {
  auto bytes = bytes_of(write("a.png"));
  bytes[bytes.size() / 2] ^= 4U;
  EXPECT_EQ(decode(bytes), ImageFileStatus::torn);
}

TEST_F(ImageFile, aChunkLengthBeyondTheFileIsTornNotReadBeyondIt) {
  auto bytes = bytes_of(write("a.png"));
  for (std::size_t i = 33; i < 37; ++i) bytes[i] = 0xff;  // length of the chunk after IHDR
  EXPECT_EQ(decode(bytes), ImageFileStatus::torn);
}

TEST_F(ImageFile, aHeadThatPromisesGigapixelsIsRefusedBeforeAnythingIsAllocated) {
  auto bytes = bytes_of(write("a.png"));
  for (std::size_t i = 16; i < 24; ++i) bytes[i] = 0x7f;
  EXPECT_EQ(decode(bytes), ImageFileStatus::not_an_image);
}

TEST_F(ImageFile, otherContentIsNotAnImage) {
  const std::string text = "this is no image, whatever its name says";
  EXPECT_EQ(decode({text.begin(), text.end()}), ImageFileStatus::not_an_image);
}

TEST_F(ImageFile, anotherSizeIsSaid) {
  test::write_tiny_image(folder_ / "b.png", 1, kTinyWidth + 1, kTinyHeight);
  EXPECT_EQ(decode(bytes_of(folder_ / "b.png")), ImageFileStatus::wrong_size);
}

TEST_F(ImageFile, missingFilesAndFoldersAreTold) {
  std::vector<std::uint8_t> bytes;
  EXPECT_EQ(read_image_file(folder_ / "none.png", &bytes), ImageFileStatus::missing);
  EXPECT_EQ(read_image_file(folder_.path(), &bytes), ImageFileStatus::unreadable);
}

TEST_F(ImageFile, theHeadTellsTheSizeOfPngAndJpeg) {
  for (const char* name : {"a.png", "a.jpg"}) {
    ImageSize size;
    ASSERT_EQ(read_image_size(write(name), &size), ImageFileStatus::ok) << name;
    EXPECT_EQ(size, kSize) << name;
  }
}

}  // namespace
}  // namespace vergence::app
