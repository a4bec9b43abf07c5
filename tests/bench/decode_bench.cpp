// What decoding an image of each recorded drive costs by itself, and encoding it again as a
// recording does (record.image_format: png):  decode_bench Files in the page cache, one thread,
// check sums and pixels; the fastest of five rounds.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <vector>

#include "app/datasets/image_file.hpp"
#include "app/recording/png_encoder.hpp"
#include "tests/support/recorded_sequence.hpp"

namespace {

using namespace vergence;

/// ms an image; nothing can be decoded: infinite.
double decode_ms(const std::vector<std::vector<std::uint8_t>>& files) {
  std::vector<std::uint8_t> pixels;
  const auto begin = std::chrono::steady_clock::now();
  for (const auto& file : files) {
    app::ImageSize size;
    if (app::check_image(file, &size) != app::ImageFileStatus::ok)
      return std::numeric_limits<double>::infinity();
    pixels.resize(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
    if (app::decode_grey(file, size, pixels.data(), static_cast<std::size_t>(size.width)) !=
        app::ImageFileStatus::ok)
      return std::numeric_limits<double>::infinity();
  }
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  return took.count() / static_cast<double>(files.size());
}

/// ms an image, and how much of its pixels' bytes the file has.
struct Encoding {
  double ms = std::numeric_limits<double>::infinity(), share = 0;
};
Encoding encode(const std::vector<std::vector<std::uint8_t>>& files, const Intrinsics& lens) {
  const auto stride = static_cast<std::size_t>(lens.width);
  std::vector<std::uint8_t> pixels(stride * static_cast<std::size_t>(lens.height));
  std::vector<std::uint8_t> out;
  std::chrono::duration<double, std::milli> took{};
  std::size_t bytes = 0;
  for (const auto& file : files) {
    if (app::decode_grey(file, {lens.width, lens.height}, pixels.data(), stride) !=
        app::ImageFileStatus::ok)
      return {};
    const auto begin = std::chrono::steady_clock::now();
    if (!app::encode_png({pixels.data(), lens.width, lens.height, lens.width}, &out)) return {};
    bytes += out.size();
    took += std::chrono::steady_clock::now() - begin;
  }
  const auto count = static_cast<double>(files.size());
  return {took.count() / count,
          static_cast<double>(bytes) / count / static_cast<double>(pixels.size())};
}

}  // namespace

int main() {
  constexpr int kRounds = 5;
  int drives = 0;
  for (const char* name : test::kRecordedSequences) {
    const auto drive = test::open_recorded(name);
    if (!drive) continue;
    ++drives;
    std::vector<std::vector<std::uint8_t>> files;
    for (const app::StereoPair& pair : drive->sequence.pairs) {
      files.emplace_back();
      (void)app::read_image_file(drive->sequence.root / pair.file[0], &files.back());
    }
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kRounds; ++i) best = std::min(best, decode_ms(files));
    const Intrinsics& c = drive->sequence.calibration.intrinsics[0];
    Encoding encoding;
    for (int i = 0; i < kRounds; ++i) {
      const Encoding now = encode(files, c);
      if (now.ms < encoding.ms) encoding = now;
    }
    std::printf(
        "%-12s %dx%d: %.2f ms an image; as PNG again %.2f ms, %.0f %% of the pixels' bytes\n", name,
        c.width, c.height, best, encoding.ms, 100 * encoding.share);
  }
  if (drives > 0) return 0;
  std::fprintf(stderr,
               "decode_bench: no recorded drives; set VERGENCE_SHARED to the folder that holds "
               "data/\n");
  return 2;
}
