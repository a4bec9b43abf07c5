// What decoding an image of each recorded drive costs by itself:  decode_bench
// Files in the page cache, one thread, check sums and pixels; the fastest of five rounds.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <vector>

#include "app/datasets/image_file.hpp"
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
    std::printf("%-12s %dx%d: %.2f ms an image\n", name, c.width, c.height, best);
  }
  if (drives > 0) return 0;
  std::fprintf(stderr,
               "decode_bench: no recorded drives; set VERGENCE_SHARED to the folder that holds "
               "data/\n");
  return 2;
}
