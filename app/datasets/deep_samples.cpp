#include "app/datasets/deep_samples.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr std::size_t kLooks = 5;  // pairs, spread over the drive: a tunnel is not all of it

std::uint16_t peak_of(const StereoSequence& s, const std::string& name,
                      std::vector<std::uint8_t>* bytes) {
  if (name.empty() || read_image_file(s.root / name, bytes) != ImageFileStatus::ok) return 0;
  return peak_of_deep_image(*bytes);
}

}  // namespace

void find_deep_bits(StereoSequence* sequence) {
  if (sequence->store || sequence->pairs.empty()) return;
  std::vector<std::uint8_t> bytes;
  std::uint16_t peak = 0;
  for (std::size_t i = 0; i < kLooks; ++i) {
    const StereoPair& pair = sequence->pairs[i * (sequence->pairs.size() - 1) / (kLooks - 1)];
    for (const std::string& name : pair.file)
      peak = std::max(peak, peak_of(*sequence, name, &bytes));
    if (peak == 0) return;  // other images
  }
  for (const int bits : {10, 12, 14})
    if (peak < 1U << static_cast<unsigned>(bits)) {
      sequence->deep_bits = bits;
      sequence->remarks.push_back(
          fmt::format("the images have 16 bits a sample, of which {} are used (the greatest sample "
                      "looked at is {}): they are taken as images of {} bits",
                      bits, peak, bits));
      return;
    }
}

}  // namespace vergence::app
