/// Any bytes as a bag, of ROS 1 or in SQLite if they begin like one, else MCAP. Entry point of
/// libFuzzer; the unit tests call it with seeded mutations.
#include <cstddef>
#include <cstdlib>

#include "app/datasets/detail/bag_index.hpp"
#include "tests/fuzz/input_errors.hpp"
#include "tests/support/bag_in_memory.hpp"

namespace {

using namespace vergence;
using namespace vergence::app;

/// Invariants of a replay; a bag that breaks it is not read as it should be.
void check(const StereoSequence& s) {
  constexpr std::size_t kMaxPixels = 1U << 20;
  for (std::size_t i = 1; i < s.pairs.size(); ++i)
    if (s.pairs[i].stamp <= s.pairs[i - 1].stamp) std::abort();
  for (std::size_t i = 1; i < s.ins->readings.size(); ++i)
    if (s.ins->readings[i].sample.stamp <= s.ins->readings[i - 1].sample.stamp) std::abort();
  for (const InsRecord& r : s.ins->readings)
    if (r.sample.fix != FixStatus::none && !r.sample.position.plausible()) std::abort();
  std::vector<std::uint8_t> out, work;
  for (const StereoPair& pair : s.pairs)
    for (const std::string& name : pair.file) {
      ImageSize image;
      if (s.store->size(name, &image) != ImageFileStatus::ok) std::abort();
      const auto width = static_cast<std::size_t>(image.width),
                 height = static_cast<std::size_t>(image.height);
      if (width * height > kMaxPixels) continue;
      out.resize(width * height);
      (void)s.store->decode(name, image, out.data(), width, 16, &work);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The exact size lets ASan find a read beyond the last byte.
  const std::vector<char> bytes(data, data + size);
  const auto format = size > 0 && data[0] == '#'   ? detail::BagFormat::rosbag
                      : size > 0 && data[0] == 'S' ? detail::BagFormat::sqlite
                                                   : detail::BagFormat::mcap;
  for (const bool given : {true, false})
    test::probe([&] { check(test::bag_in_memory(format, bytes, given)); });
  return 0;
}
