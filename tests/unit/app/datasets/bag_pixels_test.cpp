// Decoded pixels of each encoding of sensor_msgs/Image and CompressedImage, in both containers.

#include <opencv2/imgcodecs.hpp>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "core/types/bayer.hpp"
#include "tests/support/bag_in_memory.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/ros_messages.hpp"

namespace vergence::app {
namespace {

using test::BagKind;
using test::ImageMessage;

/// Stamp in ns.
constexpr std::int64_t kStart = 1'700'000'000'000'000'000;
/// Channels of the two images.
constexpr std::array<std::uint16_t, 2> kSides{1, 2};
constexpr int kWidth = 16, kHeight = 8;
/// An image of kWidth · kHeight pixels.
using Grey = std::vector<std::uint8_t>;

std::uint8_t value(int x, int y, int channel) {
  return static_cast<std::uint8_t>(7 * x + 31 * y + 85 * channel);
}

/// `channels` bytes a pixel and some between the rows.
ImageMessage image_of(const char* encoding, int channels) {
  const int step = kWidth * channels + 5;
  ImageMessage image{kWidth, kHeight, static_cast<std::uint32_t>(step), encoding, {}};
  image.data.assign(static_cast<std::size_t>(step * kHeight), '\0');
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < channels; ++c)
        image.data[static_cast<std::size_t>(y * step + x * channels + c)] =
            static_cast<char>(value(x, y, c));
  return image;
}

/// Every pixel within `most` of what `wanted` says of its place.
template <class Wanted>
void expect_grey(const Grey& out, const Wanted& wanted, const std::string& what, double most = 0) {
  ASSERT_EQ(out.size(), std::size_t{kWidth} * kHeight) << what;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      ASSERT_NEAR(out[static_cast<std::size_t>(y * kWidth + x)], wanted(x, y), most) << what;
}

class BagPixels : public ::testing::TestWithParam<BagKind> {
 protected:
  /// Writes one message for left and right, valid until the next one.
  [[nodiscard]] StereoSequence make_sequence(const char* type, const std::string& message) {
    writer_ = GetParam().writer();
    writer_->channel(1, "/left/image", type);
    writer_->channel(2, "/right/image", type);
    for (const std::uint16_t k : kSides) writer_->message(k, kStart, message);
    writer_->finish();
    return test::bag_in_memory(GetParam().is_mcap(), writer_->bytes());
  }
  /// Grey of the right image.
  [[nodiscard]] static Grey right_of(const StereoSequence& s) {
    Grey out(std::size_t{kWidth} * kHeight), work;
    EXPECT_EQ(s.store->decode(s.pairs.at(0).file[1], {kWidth, kHeight}, out.data(), kWidth,
                              s.deep_bits, &work),
              ImageFileStatus::ok);
    return out;
  }
  /// Empty: no pair.
  [[nodiscard]] Grey grey_of(const char* type, const std::string& message) {
    Grey grey;
    refusal_ = test::refusal_of([&] { grey = right_of(make_sequence(type, message)); });
    return grey;
  }
  [[nodiscard]] Grey grey_of(const ImageMessage& image) {
    return grey_of("sensor_msgs/Image", image_message(GetParam().wire(), kStart, image));
  }
  [[nodiscard]] Grey grey_of_file(const char* format, const std::string& file) {
    return grey_of("sensor_msgs/CompressedImage",
                   compressed_message(GetParam().wire(), kStart, format, file));
  }

  /// The writer owns the bytes of the bag.
  std::unique_ptr<test::BagWriter> writer_;
  std::string refusal_;
};

TEST_P(BagPixels, keepsGrey) {
  struct Case {
    const char* encoding;
    /// Bytes per pixel, and the position of the grey value in them.
    int bytes, grey;
  };
  for (const Case& c :
       {Case{"mono8", 1, 0}, Case{"8UC1", 1, 0}, Case{"nv12", 1, 0}, Case{"nv21", 1, 0},
        Case{"yuyv", 2, 0}, Case{"yuv422_yuy2", 2, 0}, Case{"uyvy", 2, 1}, Case{"yuv422", 2, 1}}) {
    const Grey out = grey_of(image_of(c.encoding, c.bytes));
    expect_grey(
        out, [&](int x, int y) { return value(x, y, c.grey); }, c.encoding + refusal_);
  }
}

// ITU-R BT.601: 0.299, 0.587, 0.114, to half a step.
TEST_P(BagPixels, weighsColoursByBt601) {
  for (const char* encoding : {"rgb8", "bgr8", "8UC3", "rgba8", "bgra8"}) {
    const int red = encoding[0] == 'r' ? 0 : 2;
    const bool alpha = std::string_view(encoding).find('a') != std::string_view::npos;
    const Grey out = grey_of(image_of(encoding, alpha ? 4 : 3));
    const auto weighed = [&](int x, int y) {
      return 0.299 * value(x, y, red) + 0.587 * value(x, y, 1) + 0.114 * value(x, y, 2 - red);
    };
    // Half a step of rounding, and 255 times what the weights in 256ths are off by.
    expect_grey(out, weighed, encoding + refusal_, 0.5 + 255 * 0.0018);
  }
}

TEST_P(BagPixels, convertsMosaicsLikeCameras) {
  for (const char* encoding : {"bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"}) {
    const ImageMessage image = image_of(encoding, 1);
    const Grey out = grey_of(image);
    ASSERT_FALSE(out.empty()) << refusal_;
    Grey wanted(out.size());
    bayer_to_grey(reinterpret_cast<const std::uint8_t*>(image.data.data()),
                  static_cast<std::ptrdiff_t>(image.step), kWidth, kHeight, wanted.data(), kWidth);
    EXPECT_EQ(out, wanted) << encoding;
  }
}

TEST_P(BagPixels, refusesOtherEncodingsAndShortData) {
  EXPECT_TRUE(grey_of(image_of("32FC1", 4)).empty());
  EXPECT_TRUE(test::mentions(refusal_, "/left/image (0 images, 1 of the unsupported encoding"));
  ImageMessage image = image_of("mono8", 1);
  image.data.pop_back();
  EXPECT_TRUE(grey_of(image).empty());
  image.step = 0;
  EXPECT_FALSE(grey_of(image).empty()) << "a step that is not set";
  // The rows are too short for three bytes per pixel.
  EXPECT_TRUE(grey_of(image_of("rgb8", 1)).empty());
  EXPECT_TRUE(grey_of(image_of("mono16", 1)).empty());
}

TEST_P(BagPixels, detectsPngAndJpegByContent) {
  cv::Mat source(kHeight, kWidth, CV_8U);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) source.at<std::uint8_t>(y, x) = value(x, y, 0) / 2;
  for (const char* ending : {".png", ".jpg"}) {
    std::vector<std::uint8_t> file;
    ASSERT_TRUE(cv::imencode(ending, source, file));
    const Grey out =
        grey_of_file("mono8; what a transport writes here", std::string(file.begin(), file.end()));
    const cv::Mat wanted = cv::imdecode(file, cv::IMREAD_GRAYSCALE);
    // Two decoders of JPEG may differ by their rounding.
    expect_grey(
        out, [&](int x, int y) { return wanted.at<std::uint8_t>(y, x); }, ending + refusal_,
        ending[1] == 'p' ? 0 : 1);
  }
  EXPECT_TRUE(grey_of_file("png", "no image at all").empty());
}

// TUM VI's and many industrial cameras' way.
TEST_P(BagPixels, readsSixteenBitsInEitherByteOrder) {
  for (const char* encoding : {"mono16", "16UC1"})
    for (const bool big_endian : {false, true})
      for (const int bits : {12, 16}) {
        const int step = 2 * kWidth + 6;
        ImageMessage image{kWidth, kHeight, static_cast<std::uint32_t>(step), encoding, {}};
        image.big_endian = big_endian;
        image.data.assign(static_cast<std::size_t>(step * kHeight), '\xff');
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) {
            const int sample = value(x, y, 0) << (bits - 8);
            const auto at = static_cast<std::size_t>(y * step + 2 * x);
            image.data[at + (big_endian ? 0 : 1)] = static_cast<char>(sample >> 8);
            image.data[at + (big_endian ? 1 : 0)] = static_cast<char>(sample & 255);
          }
        StereoSequence s =
            make_sequence("sensor_msgs/Image", image_message(GetParam().wire(), kStart, image));
        find_deep_bits(&s);
        EXPECT_EQ(s.deep_bits, bits);
        expect_grey(
            right_of(s), [](int x, int y) { return value(x, y, 0); }, encoding);
      }
}

INSTANTIATE_TEST_SUITE_P(Containers, BagPixels,
                         ::testing::Values(BagKind{"mcap", "zstd"}, BagKind{"rosbag", "lz4"}));

}  // namespace
}  // namespace vergence::app
