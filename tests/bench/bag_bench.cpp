// What reading a bag costs beside decoding its images:  bag_bench [PAIRS]
// PNG of 640 x 480, a pair and an Imu a chunk, the file in the page cache; one thread.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <opencv2/imgcodecs.hpp>

#include "app/datasets/detail/formats.hpp"
#include "core/math/random.hpp"
#include "tests/support/ros_messages.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::test {
namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kStep = 50'000'000;  // ns

/// Slopes with 6 bits of noise: about as many bytes as an outdoor image.
std::string png(std::uint64_t seed) {
  Random random(seed);
  cv::Mat picture(kHeight, kWidth, CV_8U);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      picture.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>((x + y) / 8 + static_cast<int>(random.below(64)));
  std::vector<std::uint8_t> file;
  (void)cv::imencode(".png", picture, file);
  return {file.begin(), file.end()};
}

double ms_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

void measure(const BagKind& kind, const std::vector<std::string>& pictures, std::int64_t pairs) {
  const TemporaryFolder folder;
  std::filesystem::path file;
  {
    const auto writer = kind.writer();
    writer->channel(1, "/left/image/compressed", "sensor_msgs/CompressedImage");
    writer->channel(2, "/right/image/compressed", "sensor_msgs/CompressedImage");
    writer->channel(3, "/imu", "sensor_msgs/Imu");
    for (std::int64_t i = 0; i < pairs; ++i) {
      const std::int64_t ns = kStart + i * kStep;
      for (std::uint16_t k = 0; k < 2; ++k)
        writer->message(
            static_cast<std::uint16_t>(k + 1), ns,
            compressed_message(kind.wire(), ns, "png",
                               pictures[(static_cast<std::size_t>(2 * i) + k) % pictures.size()]));
      writer->message(3, ns, imu_message(kind.wire(), ns, {0, 0, 0, 1}, 1e-4));
      writer->close_chunk();
    }
    writer->finish();
    file = folder.write("a" + kind.ending(), writer->bytes());
  }
  using namespace app;
  const auto format = kind.is_mcap() ? detail::BagFormat::mcap : detail::BagFormat::rosbag;
  double index = 1e300;
  StereoSequence s;
  for (int i = 0; i < 3; ++i) {  // the first fills the page cache
    const auto begin = std::chrono::steady_clock::now();
    s = detail::open_bag(format, file, true, {});
    index = std::min(index, ms_since(begin));
  }
  std::vector<std::uint8_t> out(std::size_t{kWidth} * kHeight), work;
  const auto begin = std::chrono::steady_clock::now();
  for (const StereoPair& pair : s.pairs)
    for (const std::string& name : pair.file)
      if (s.store->decode(name, {kWidth, kHeight}, out.data(), kWidth, 16, &work) !=
          ImageFileStatus::ok)
        std::printf("%s cannot be decoded\n", name.c_str());
  std::printf("%-7s %-5s %5zu pairs %7.1f MB   index %8.1f ms   images %8.1f ms\n", kind.container,
              kind.compression, s.pairs.size(),
              static_cast<double>(std::filesystem::file_size(file)) * 1e-6, index, ms_since(begin));
}

}  // namespace
}  // namespace vergence::test

int main(int count, char** words) {
  using namespace vergence::test;
  const std::int64_t pairs = count > 1 ? std::atoll(words[1]) : 250;
  std::vector<std::string> pictures;
  for (std::uint64_t i = 0; i < 20; ++i) pictures.push_back(png(i));
  for (const BagKind& kind :
       {BagKind{"mcap", ""}, BagKind{"mcap", "lz4"}, BagKind{"mcap", "zstd"},
        BagKind{"rosbag", "none"}, BagKind{"rosbag", "lz4"}, BagKind{"rosbag", "bz2"}})
    measure(kind, pictures, pairs);
  return 0;
}
