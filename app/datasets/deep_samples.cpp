#include "app/datasets/deep_samples.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr std::size_t kLooks = 5;  // pairs, spread over the drive: a tunnel is not all of it

/// Nothing: an image of another kind. 0: one that says nothing, for it is missing, torn or black.
std::optional<std::uint16_t> peak_of(const StereoSequence& s, const std::string& name,
                                     std::vector<std::uint8_t>* bytes) {
  if (name.empty()) return std::uint16_t{0};
  if (s.store) return s.store->peak(name, bytes);
  return read_image_file(s.root / name, bytes) == ImageFileStatus::ok ? peak_of_deep_image(*bytes)
                                                                      : std::uint16_t{0};
}

}  // namespace

void find_deep_bits(StereoSequence* sequence) {
  if (sequence->pairs.empty()) return;
  std::vector<std::uint8_t> bytes;
  std::uint16_t peak = 0;
  for (std::size_t i = 0; i < kLooks; ++i) {
    const StereoPair& pair = sequence->pairs[i * (sequence->pairs.size() - 1) / (kLooks - 1)];
    for (const std::string& name : pair.file) {
      const auto found = peak_of(*sequence, name, &bytes);
      if (!found) return;
      peak = std::max(peak, *found);
    }
  }
  if (peak == 0) return;
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
