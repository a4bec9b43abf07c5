/// Any bytes as drive.mcap of a session, read for a replay. Entry point of libFuzzer.
#include <cstddef>
#include <cstdint>

#include "app/datasets/recorded_session.hpp"
#include "tests/fuzz/input_errors.hpp"
#include "tests/fuzz/scratch_folder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence;
  constexpr int kMaxPixels = 1 << 20;
  static const test::ScratchFolder folder;
  folder.write("drive.mcap", {reinterpret_cast<const char*>(data), size});
  test::probe([&] {
    const auto session = app::RecordedSession::open(folder.path());
    std::vector<std::uint8_t> pixels;
    for (const app::RecordedFrame& frame : session.frames())
      for (std::size_t k = 0; k < frame.images.size(); ++k) {
        const app::RecordedImage& image = frame.images[k];
        if (image.offset == 0 || image.width <= 0 || image.height <= 0 ||
            image.width > kMaxPixels / image.height)
          continue;
        pixels.resize(static_cast<std::size_t>(image.width) *
                      static_cast<std::size_t>(image.height));
        (void)session.read(frame, k, pixels.data(), static_cast<std::size_t>(image.width));
      }
  });
  return 0;
}
