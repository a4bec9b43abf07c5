// Against OpenCV's decoder, which the same files went through before, and against files that want
// to do harm.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include <array>

#include "app/datasets/image_file.hpp"
#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

using FileBytes = std::vector<std::uint8_t>;

void append_u32(FileBytes* to, std::uint32_t v) {
  for (const unsigned shift : {24U, 16U, 8U, 0U})
    to->push_back(static_cast<std::uint8_t>(v >> shift));
}

void append_chunk(FileBytes* png, std::string_view type, const FileBytes& data) {
  append_u32(png, static_cast<std::uint32_t>(data.size()));
  const std::size_t at = png->size();
  png->insert(png->end(), type.begin(), type.end());
  png->insert(png->end(), data.begin(), data.end());
  append_u32(png, static_cast<std::uint32_t>(
                      crc32(0, png->data() + at, static_cast<uInt>(data.size() + 4))));
}

FileBytes deflated(const FileBytes& raw) {
  uLongf size = compressBound(raw.size());
  FileBytes packed(size);
  (void)compress2(packed.data(), &size, raw.data(), raw.size(), 6);
  packed.resize(size);
  return packed;
}

/// Head of a PNG before its pixels. `colours` as in IHDR: 0 grey, 2 RGB, 3 palette, 4 grey and
/// alpha, 6 RGBA.
struct PngKind {
  int colours = 0, depth = 8;
  bool interlaced = false;
};

FileBytes png_head(const PngKind& kind, int width, int height) {
  FileBytes png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, head;
  append_u32(&head, static_cast<std::uint32_t>(width));
  append_u32(&head, static_cast<std::uint32_t>(height));
  for (const int v : {kind.depth, kind.colours, 0, 0, kind.interlaced ? 1 : 0})
    head.push_back(static_cast<std::uint8_t>(v));
  append_chunk(&png, "IHDR", head);
  return png;
}

/// Bytes of all rows with their filter bytes, of all seven passes where it is interlaced.
std::vector<std::size_t> png_row_sizes(const PngKind& kind, int width, int height) {
  const int samples = kind.colours == 2 ? 3 : kind.colours == 4 ? 2 : kind.colours == 6 ? 4 : 1;
  constexpr int kPasses[7][4] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                 {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
  constexpr int kWhole[4] = {0, 0, 1, 1};
  std::vector<std::size_t> rows;
  for (int pass = 0; pass < (kind.interlaced ? 7 : 1); ++pass) {
    const auto& p = kind.interlaced ? kPasses[pass] : kWhole;
    const int columns = (width - p[0] + p[2] - 1) / p[2], lines = (height - p[1] + p[3] - 1) / p[3];
    if (columns <= 0) continue;
    for (int y = 0; y < lines; ++y)
      rows.push_back(1 + static_cast<std::size_t>((columns * samples * kind.depth + 7) / 8));
  }
  return rows;
}

/// Pixels of noise; every row with the next of the five filters.
FileBytes png_noise(const PngKind& kind, int width, int height) {
  FileBytes raw;
  std::uint32_t noise = 12345;
  int filter = 0;
  for (const std::size_t size : png_row_sizes(kind, width, height)) {
    raw.push_back(static_cast<std::uint8_t>(filter++ % 5));
    for (std::size_t i = 1; i < size; ++i) {
      noise = noise * 1664525U + 1013904223U;
      raw.push_back(static_cast<std::uint8_t>(noise >> 24U));
    }
  }
  return raw;
}

/// The size is no multiple of eight, so that interlacing and single bits have row ends.
constexpr int kWidth = 37, kHeight = 21;

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
  FileBytes png = png_head(kind, kWidth, kHeight);
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
  append_chunk(&png, "IDAT", deflated(png_noise(kind, kWidth, kHeight)));
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

TEST(PngDecoder, everyKindEqualsOpenCv) {
  for (const PngKind& kind : every_png_kind())
    // The second chunk is a gamma of 0.45455.
    for (const FileBytes& gamma : {FileBytes{}, FileBytes{0, 0, 0xb1, 0x8f}})
      for (const bool transparent : {false, true}) {
        // These kinds have an alpha channel already.
        if (transparent && kind.colours > 3) continue;
        expect_opencvs_pixels(
            noisy_png(kind, gamma, transparent), kWidth, kHeight,
            fmt::format("colours {} depth {} interlaced {} gamma {} transparent {}", kind.colours,
                        kind.depth, kind.interlaced, !gamma.empty(), transparent));
      }
}

TEST(PngDecoder, usesEffectiveBitsAndSaturates) {
  cv::Mat ramp(1, 8, CV_16UC1);
  for (int x = 0; x < 8; ++x) ramp.at<std::uint16_t>(0, x) = static_cast<std::uint16_t>(585 * x);
  FileBytes png;
  ASSERT_TRUE(cv::imencode(".png", ramp, png));
  std::array<std::uint8_t, 8> out{};
  for (const int bits : {16, 12, 10}) {
    ASSERT_EQ(decode_grey(png, {8, 1}, out.data(), 8, bits), ImageFileStatus::ok);
    for (int x = 0; x < 8; ++x)
      EXPECT_EQ(out[static_cast<std::size_t>(x)], std::min(585 * x >> (bits - 8), 255))
          << "bits " << bits << " column " << x;
  }
}

/// A picture with structure: noise alone says little about a JPEG.
cv::Mat test_image() {
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

TEST(JpegDecoder, everyKindEqualsOpenCv) {
  const cv::Mat colour = test_image();
  cv::Mat grey;
  cv::extractChannel(colour, grey, 2);
  expect_opencvs_pixels(jpeg_of(grey), 83, 61, "grey");
  expect_opencvs_pixels(jpeg_of(colour), 83, 61, "colour");
  expect_opencvs_pixels(jpeg_of(colour, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}), 83, 61, "progressive");
  expect_opencvs_pixels(jpeg_of(grey, {cv::IMWRITE_JPEG_RST_INTERVAL, 2}), 83, 61,
                        "restart markers");
}

ImageFileStatus decode(const FileBytes& file, int width, int height) {
  FileBytes out(static_cast<std::size_t>(width * height));
  return decode_grey(file, {width, height}, out.data(), static_cast<std::size_t>(width));
}

TEST(JpegDecoder, detectsMissingDataBeforeEnd) {
  cv::Mat noise(96, 96, CV_8UC1);
  for (int y = 0; y < noise.rows; ++y)
    for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = test::tiny_pixel(x, y, 3);
  FileBytes file = jpeg_of(noise);
  const auto third = static_cast<std::ptrdiff_t>(file.size() / 3);
  file.erase(file.begin() + third, file.begin() + 2 * third);
  EXPECT_EQ(decode(file, 96, 96), ImageFileStatus::truncated);
}

TEST(JpegDecoder, limitsNumberOfScans) {
  const FileBytes file = jpeg_of(test_image(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  // The last scan only refines, and may be repeated.
  std::size_t last = 0;
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

TEST(PngDecoder, skipsHugeCompressedChunksWithoutMemory) {
  const FileBytes zeros(std::size_t{100} << 20, 0);
  const FileBytes packed = deflated(zeros);
  FileBytes profile{'p', 0, 0}, text{'t', 0, 0};
  profile.insert(profile.end(), packed.begin(), packed.end());
  text.insert(text.end(), packed.begin(), packed.end());
  const PngKind kind;
  FileBytes png = png_head(kind, kWidth, kHeight);
  append_chunk(&png, "iCCP", profile);
  append_chunk(&png, "zTXt", text);
  append_chunk(&png, "IDAT", deflated(png_noise(kind, kWidth, kHeight)));
  append_chunk(&png, "IEND", {});
  const long before = peak_kib();
  EXPECT_EQ(decode(png, kWidth, kHeight), ImageFileStatus::ok);
  EXPECT_LT(peak_kib() - before, 32 * 1024);
}

TEST(PngDecoder, staysInRowsOnWrongPixelCount) {
  const PngKind kind;
  for (const int rows : {0, 1, kHeight - 1, kHeight + 1, 40 * kHeight}) {
    FileBytes png = png_head(kind, kWidth, kHeight);
    append_chunk(&png, "IDAT", deflated(png_noise(kind, kWidth, rows)));
    append_chunk(&png, "IEND", {});
    EXPECT_EQ(decode(png, kWidth, kHeight),
              rows < kHeight ? ImageFileStatus::truncated : ImageFileStatus::ok)
        << rows;
  }
}

}  // namespace
}  // namespace vergence::app
