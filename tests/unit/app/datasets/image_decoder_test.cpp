// Against OpenCV's decoder, which the same files went through before, and against files that want
// to do harm.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <cstdio>

#include <jpeglib.h>
#include <opencv2/imgcodecs.hpp>

#include "app/datasets/image_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/unit/app/datasets/png_bytes.hpp"
#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

using test::append_chunk;
using test::FileBytes;
using test::PngKind;

constexpr int kWidth = 37,
              kHeight = 21;  // no multiple of eight: interlacing and single bits have ends of rows

cv::Mat by_opencv(const FileBytes& file) {
  return cv::imdecode(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
}

void expect_opencvs_pixels(const FileBytes& file, int width, int height, const std::string& what) {
  const cv::Mat expected = by_opencv(file);
  ASSERT_EQ(expected.size(), cv::Size(width, height)) << what;
  FileBytes out(static_cast<std::size_t>(width * height));
  ASSERT_EQ(decode_grey(file, {width, height}, out.data(), static_cast<std::size_t>(width)),
            ImageFileStatus::ok)
      << what;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      ASSERT_EQ(out[static_cast<std::size_t>(y * width + x)], expected.at<std::uint8_t>(y, x))
          << what << " at " << x << " " << y;
}

/// A PNG of noise; `more` stands between IHDR and the palette: gAMA, or nothing.
FileBytes noisy_png(const PngKind& kind, const FileBytes& gamma, bool transparent) {
  FileBytes png = test::png_head(kind, kWidth, kHeight);
  if (!gamma.empty()) append_chunk(&png, "gAMA", gamma);
  if (kind.colours == 3) {
    FileBytes palette;
    for (int i = 0; i < 3 << kind.depth; ++i)
      palette.push_back(static_cast<std::uint8_t>(i * 89 + 7));
    append_chunk(&png, "PLTE", palette);
  }
  if (transparent)
    append_chunk(&png, "tRNS",
                 kind.colours == 3 ? FileBytes{0, 128} : FileBytes(kind.colours == 2 ? 6 : 2, 0));
  append_chunk(&png, "IDAT", test::deflated(test::png_noise(kind, kWidth, kHeight)));
  append_chunk(&png, "IEND", {});
  return png;
}

std::vector<PngKind> every_png_kind() {
  std::vector<PngKind> kinds;
  for (const bool interlaced : {false, true}) {
    for (const int depth : {1, 2, 4, 8, 16}) kinds.push_back({0, depth, interlaced});
    for (const int depth : {1, 2, 4, 8}) kinds.push_back({3, depth, interlaced});
    for (const int colours : {2, 4, 6})
      for (const int depth : {8, 16}) kinds.push_back({colours, depth, interlaced});
  }
  return kinds;
}

TEST(PngDecoder, everyKindHasOpenCvsPixelsToTheBit) {
  for (const PngKind& kind : every_png_kind())
    for (const FileBytes& gamma : {FileBytes{}, FileBytes{0, 0, 0xb1, 0x8f}})  // none, 0.45455
      for (const bool transparent : {false, true}) {
        if (transparent && kind.colours > 3) continue;  // has its alpha already
        expect_opencvs_pixels(
            noisy_png(kind, gamma, transparent), kWidth, kHeight,
            fmt::format("colours {} depth {} interlaced {} gamma {} transparent {}", kind.colours,
                        kind.depth, kind.interlaced, !gamma.empty(), transparent));
      }
}

TEST(PngDecoder, ofSixteenBitsThoseThatAreUsedAreTakenAndWhatIsBeyondIsWhite) {
  cv::Mat ramp(1, 8, CV_16UC1);
  for (int x = 0; x < 8; ++x) ramp.at<std::uint16_t>(0, x) = static_cast<std::uint16_t>(585 * x);
  FileBytes png;
  ASSERT_TRUE(cv::imencode(".png", ramp, png));
  EXPECT_EQ(peak_of_deep_image(png), 4095);
  std::array<std::uint8_t, 8> out{};
  for (const int bits : {16, 12, 10}) {
    ASSERT_EQ(decode_grey(png, {8, 1}, out.data(), 8, bits), ImageFileStatus::ok);
    for (int x = 0; x < 8; ++x)
      EXPECT_EQ(out[static_cast<std::size_t>(x)], std::min(585 * x >> (bits - 8), 255))
          << "bits " << bits << " column " << x;
  }
  EXPECT_EQ(peak_of_deep_image(noisy_png({0, 8, false}, {}, false)), std::nullopt);
  EXPECT_EQ(peak_of_deep_image({}), 0);
}

/// A picture with structure: noise alone says little about a JPEG.
cv::Mat picture() {
  cv::Mat image(61, 83, CV_8UC3);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(3 * x),
                                   static_cast<std::uint8_t>(x * y / 20),
                                   static_cast<std::uint8_t>(((x / 7 + y / 5) % 2) * 200)};
  return image;
}

FileBytes jpeg_of(const cv::Mat& image, const std::vector<int>& options = {}) {
  FileBytes file;
  EXPECT_TRUE(cv::imencode(".jpg", image, file, options));
  return file;
}

TEST(JpegDecoder, greyColourAndProgressiveHaveOpenCvsPixelsToTheBit) {
  const cv::Mat colour = picture();
  cv::Mat grey;
  cv::extractChannel(colour, grey, 2);
  expect_opencvs_pixels(jpeg_of(grey), 83, 61, "grey");
  expect_opencvs_pixels(jpeg_of(colour), 83, 61, "colour");
  expect_opencvs_pixels(jpeg_of(colour, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}), 83, 61, "progressive");
  expect_opencvs_pixels(jpeg_of(grey, {cv::IMWRITE_JPEG_RST_INTERVAL, 2}), 83, 61,
                        "restart markers");
}

/// Four colours, as printers have them.
FileBytes cmyk_jpeg(int width, int height) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width);
  jpeg.image_height = static_cast<JDIMENSION>(height);
  jpeg.input_components = 4;
  jpeg.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  FileBytes row(static_cast<std::size_t>(4 * width), 90);
  for (JSAMPROW rows[1] = {row.data()}; jpeg.next_scanline < jpeg.image_height;)
    (void)jpeg_write_scanlines(&jpeg, rows, 1);
  jpeg_finish_compress(&jpeg);
  FileBytes file(memory, memory + size);
  jpeg_destroy_compress(&jpeg);
  std::free(memory);
  return file;
}

ImageFileStatus decode(const FileBytes& file, int width, int height) {
  FileBytes out(static_cast<std::size_t>(width * height));
  return decode_grey(file, {width, height}, out.data(), static_cast<std::size_t>(width));
}

TEST(JpegDecoder, fourColoursAreRefusedAndTheSentenceSaysWhatCanBeRead) {
  EXPECT_EQ(decode(cmyk_jpeg(40, 30), 40, 30), ImageFileStatus::undecodable);
  EXPECT_TRUE(test::says(std::string(to_phrase(ImageFileStatus::undecodable)),
                         "JPEG of 8-bit grey or three colours"));
}

TEST(JpegDecoder, aHoleInTheMiddleIsTornThoughTheEndIsThere) {
  cv::Mat noise(96, 96, CV_8UC1);
  for (int y = 0; y < noise.rows; ++y)
    for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = test::tiny_pixel(x, y, 3);
  FileBytes file = jpeg_of(noise);
  const auto third = static_cast<std::ptrdiff_t>(file.size() / 3);
  file.erase(file.begin() + third, file.begin() + 2 * third);
  EXPECT_EQ(decode(file, 96, 96), ImageFileStatus::torn);
}

TEST(JpegDecoder, moreScansThanACameraWritesAreRefusedBeforeTheyTakeHours) {
  const FileBytes file = jpeg_of(picture(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  std::size_t last = 0;  // of the scans: it only refines, and may come again
  for (std::size_t i = 2; i + 1 < file.size(); ++i)
    if (file[i] == 0xff && file[i + 1] == 0xda) last = i;
  ASSERT_GT(last, 0U);
  FileBytes many(file.begin(), file.end() - 2);
  const FileBytes scan(file.begin() + static_cast<std::ptrdiff_t>(last), file.end() - 2);
  for (int i = 0; i < 1000; ++i) many.insert(many.end(), scan.begin(), scan.end());
  many.insert(many.end(), {0xff, 0xd9});
  EXPECT_NE(decode(many, 83, 61), ImageFileStatus::ok);
}

long peak_kib() {
  rusage used{};
  (void)getrusage(RUSAGE_SELF, &used);
  return used.ru_maxrss;
}

TEST(PngDecoder, chunksThatUnfoldToAHundredMegabytesTakeNoMemory) {
  const FileBytes zeros(std::size_t{100} << 20, 0);
  const FileBytes packed = test::deflated(zeros);
  FileBytes profile{'p', 0, 0}, text{'t', 0, 0};
  profile.insert(profile.end(), packed.begin(), packed.end());
  text.insert(text.end(), packed.begin(), packed.end());
  const PngKind kind;
  FileBytes png = test::png_head(kind, kWidth, kHeight);
  append_chunk(&png, "iCCP", profile);
  append_chunk(&png, "zTXt", text);
  append_chunk(&png, "IDAT", test::deflated(test::png_noise(kind, kWidth, kHeight)));
  append_chunk(&png, "IEND", {});
  const long before = peak_kib();
  EXPECT_EQ(decode(png, kWidth, kHeight), ImageFileStatus::ok);
  EXPECT_LT(peak_kib() - before, 32 * 1024);
}

TEST(PngDecoder, pixelsThatAreFewerOrMoreThanTheHeadSaysStayInTheirRows) {
  const PngKind kind;
  for (const int rows : {0, 1, kHeight - 1, kHeight + 1, 40 * kHeight}) {
    FileBytes png = test::png_head(kind, kWidth, kHeight);
    append_chunk(&png, "IDAT", test::deflated(test::png_noise(kind, kWidth, rows)));
    append_chunk(&png, "IEND", {});
    EXPECT_EQ(decode(png, kWidth, kHeight),
              rows < kHeight ? ImageFileStatus::torn : ImageFileStatus::ok)
        << rows;
  }
}

TEST(ImageDecoder, anAreaThatNoCameraHasIsRefusedBeforeAnythingIsTakenForIt) {
  FileBytes png = test::png_head({}, 32768, 32768);
  append_chunk(&png, "IDAT", {});
  append_chunk(&png, "IEND", {});
  ImageSize size;
  EXPECT_EQ(check_image(png, &size), ImageFileStatus::not_an_image);
}

}  // namespace
}  // namespace vergence::app
