#include "app/datasets/image_file.hpp"

#include <sys/stat.h>

#include <sys/resource.h>

#include "app/datasets/image_writer.hpp"
#include "tests/support/refusal.hpp"
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

/// This process may open no further file while it lives.
class NoMoreFiles {
 public:
  NoMoreFiles() {
    getrlimit(RLIMIT_NOFILE, &former_);
    const rlimit none{0, former_.rlim_max};
    setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoMoreFiles() { setrlimit(RLIMIT_NOFILE, &former_); }
  NoMoreFiles(const NoMoreFiles&) = delete;
  NoMoreFiles& operator=(const NoMoreFiles&) = delete;

 private:
  rlimit former_{};
};

TEST_F(ImageFile, reportsTooManyOpenFiles) {
  const auto file = write("a.png");
  std::vector<std::uint8_t> bytes;
  ImageSize size;
  {
    const NoMoreFiles none;
    EXPECT_EQ(read_image_file(file, &bytes), ImageFileStatus::too_many_files);
    EXPECT_EQ(read_image_size(file, &size), ImageFileStatus::too_many_files);
  }
  EXPECT_EQ(read_image_file(file, &bytes), ImageFileStatus::ok);
  EXPECT_TRUE(test::mentions(std::string(to_phrase(ImageFileStatus::too_many_files)), "ulimit -n"));
}

/// A tiny grey BMP as OpenCV writes it.
std::vector<std::uint8_t> tiny_bmp(const test::TemporaryFolder& folder, const cv::Mat& image) {
  cv::imwrite((folder / "a.bmp").string(), image);
  return bytes_of(folder / "a.bmp");
}

TEST_F(ImageFile, readsGreyBmpInBothRowOrders) {
  auto bytes = bytes_of(write("a.bmp"));
  std::vector<std::uint8_t> out(kStride * kTinyHeight, 77);
  ASSERT_EQ(decode_grey(bytes, kSize, out.data(), kStride), ImageFileStatus::ok);
  for (int y = 0; y < kTinyHeight; ++y)
    for (int x = 0; x < static_cast<int>(kStride); ++x)
      ASSERT_EQ(out[static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x)],
                x < kTinyWidth ? test::tiny_pixel(x, y, 5) : 77);
  // With a negative height, the first row is the top one.
  const std::uint32_t turned = 0U - static_cast<std::uint32_t>(kTinyHeight);
  for (std::size_t i = 0; i < 4; ++i) bytes[22 + i] = static_cast<std::uint8_t>(turned >> (8 * i));
  ASSERT_EQ(decode_grey(bytes, kSize, out.data(), kStride), ImageFileStatus::ok);
  EXPECT_EQ(out[0], test::tiny_pixel(0, kTinyHeight - 1, 5));
  ImageSize size;
  EXPECT_EQ(read_image_size(folder_ / "a.bmp", &size), ImageFileStatus::ok);
  EXPECT_EQ(size, kSize);
}

TEST_F(ImageFile, refusesTruncatedBmpAndOtherDepths) {
  const auto bytes = tiny_bmp(folder_, cv::Mat(kTinyHeight, kTinyWidth, CV_8UC1, cv::Scalar(90)));
  for (std::size_t n = 2; n < bytes.size(); n += n < 60 ? 1 : 37)
    EXPECT_EQ(decode({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n)}),
              ImageFileStatus::truncated)
        << n;
  auto other = bytes;
  // This byte is the number of bits per pixel.
  other[28] = 16;
  EXPECT_NE(decode(other), ImageFileStatus::ok);
}

TEST_F(ImageFile, convertsColourBmpToLuminance) {
  std::vector<std::uint8_t> out(kStride * kTinyHeight);
  const auto grey_of = [&](const std::vector<std::uint8_t>& bytes) {
    EXPECT_EQ(decode_grey(bytes, kSize, out.data(), kStride), ImageFileStatus::ok);
    EXPECT_EQ(out[kStride * (kTinyHeight - 1) + kTinyWidth - 1], out.front());
    return static_cast<int>(out.front());
  };
  // 0.299 · 70 + 0.587 · 80 + 0.114 · 90 = 78.15
  const cv::Scalar colour(90, 80, 70, 255);
  EXPECT_EQ(grey_of(tiny_bmp(folder_, cv::Mat(kTinyHeight, kTinyWidth, CV_8UC3, colour))), 78);
  EXPECT_EQ(grey_of(tiny_bmp(folder_, cv::Mat(kTinyHeight, kTinyWidth, CV_8UC4, colour))), 78);
  auto painted = tiny_bmp(folder_, cv::Mat(kTinyHeight, kTinyWidth, CV_8UC1, cv::Scalar(90)));
  // This byte is the blue value of palette entry 90.
  painted[14 + 40 + 4 * 90] = 255;
  EXPECT_EQ(grey_of(painted), 109) << "0.886 · 90 + 0.114 · 255";
}

TEST_F(ImageFile, detectsEveryTruncation) {
  for (const char* name : {"a.png", "a.jpg"}) {
    const auto whole = bytes_of(write(name));
    ASSERT_EQ(decode(whole), ImageFileStatus::ok);
    for (std::size_t n = 0; n < whole.size(); n += n < 200 ? 1 : 37) {
      const std::vector<std::uint8_t> part(whole.begin(),
                                           whole.begin() + static_cast<std::ptrdiff_t>(n));
      // A few bytes do not identify a format.
      const ImageFileStatus status = decode(part);
      EXPECT_TRUE(status == ImageFileStatus::truncated ||
                  (n < 8 && status == ImageFileStatus::not_an_image))
          << name << " cut at " << n;
    }
    auto lacks_one = whole;
    lacks_one.pop_back();
    EXPECT_EQ(decode(lacks_one), ImageFileStatus::truncated) << name;
  }
}

TEST_F(ImageFile, refusesCorruptPng) {
  const auto whole = bytes_of(write("a.png"));
  const auto with = [&](std::size_t first, std::size_t last, std::uint8_t value) {
    auto bytes = whole;
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(first),
              bytes.begin() + static_cast<std::ptrdiff_t>(last), value);
    return decode(bytes);
  };
  const std::size_t middle = whole.size() / 2;
  EXPECT_EQ(with(middle, middle + 1, static_cast<std::uint8_t>(whole[middle] ^ 4U)),
            ImageFileStatus::truncated)
      << "a bit of the pixels";
  EXPECT_EQ(with(33, 37, 0xff), ImageFileStatus::truncated) << "a length beyond the file";
  EXPECT_EQ(with(16, 24, 0x7f), ImageFileStatus::not_an_image) << "gigapixels";
  EXPECT_EQ(with(0, 40, 'x'), ImageFileStatus::not_an_image) << "another content";
  test::write_tiny_image(folder_ / "b.png", 1, kTinyWidth + 1, kTinyHeight);
  EXPECT_EQ(decode(bytes_of(folder_ / "b.png")), ImageFileStatus::wrong_size);
}

TEST_F(ImageFile, doesNotBlockOnNonFiles) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe.png").c_str(), 0600), 0);
  std::vector<std::uint8_t> bytes;
  EXPECT_EQ(read_image_file(folder_ / "pipe.png", &bytes), ImageFileStatus::unreadable);
  EXPECT_EQ(read_image_file(folder_ / "none.png", &bytes), ImageFileStatus::missing);
  EXPECT_EQ(read_image_file(folder_.path(), &bytes), ImageFileStatus::unreadable);
}

TEST_F(ImageFile, writesPngWithoutPadding) {
  std::vector<std::uint8_t> pixels(kStride * kTinyHeight, 77);
  for (int y = 0; y < kTinyHeight; ++y)
    for (int x = 0; x < kTinyWidth; ++x)
      pixels[static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x)] =
          test::tiny_pixel(x, y, 9);
  const ImageView image{pixels.data(), kTinyWidth, kTinyHeight,
                        static_cast<std::ptrdiff_t>(kStride)};
  write_png(folder_ / "w.png", image);
  std::vector<std::uint8_t> out(kStride * kTinyHeight, 77);
  ASSERT_EQ(decode_grey(bytes_of(folder_ / "w.png"), kSize, out.data(), kStride),
            ImageFileStatus::ok);
  EXPECT_EQ(out, pixels);
  EXPECT_THROW(write_png(folder_ / "no such folder/w.png", image), InputError);
}

}  // namespace
}  // namespace vergence::app
