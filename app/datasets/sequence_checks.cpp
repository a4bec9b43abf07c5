#include <algorithm>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/bag_images.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

// In s. No stereo camera is faster than the first, and motion cannot be predicted across the
// second.
constexpr double kShortestStep = 1e-3, kLongestStep = 10;
// The pairs are spread over the sequence, because a part of it may be dark.
constexpr std::size_t kSampledPairs = 5;

/// Empty for other images; 0 for a missing, truncated or black image.
std::optional<std::uint16_t> find_peak(const StereoSequence& s, const std::string& name,
                                       std::vector<std::uint8_t>* bytes) {
  if (name.empty()) return std::uint16_t{0};
  if (s.store) return s.store->peak(name, bytes);
  return read_image_file(s.root / name, bytes) == ImageFileStatus::ok ? peak_of_deep_image(*bytes)
                                                                      : std::uint16_t{0};
}

std::string text(ImageSize s) { return std::to_string(s.width) + "x" + std::to_string(s.height); }

}  // namespace

void check_times(const StereoSequence& sequence) {
  // Half of the 64-bit range in ns, 1823 to 2116, so that differences of two stamps do not
  // overflow.
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
  const std::filesystem::path file = sequence.times.empty() ? sequence.root : sequence.times;
  for (const StereoPair& pair : sequence.pairs)
    if (pair.stamp.ns() > kFarthest || pair.stamp.ns() < -kFarthest)
      refuse(file, 0,
             "has the stamp {} ns, {} s from 1970, outside the years 1824 to 2116; check its unit "
             "and that the line is complete",
             pair.stamp.ns(), format_seconds(pair.stamp.ns()));
  if (sequence.pairs.size() < 3) return;
  // Forward steps in s.
  std::vector<double> steps;
  std::size_t backward = 0;
  for (std::size_t i = 1; i < sequence.pairs.size(); ++i) {
    const double step = (static_cast<double>(sequence.pairs[i].stamp.ns()) -
                         static_cast<double>(sequence.pairs[i - 1].stamp.ns())) *
                        1e-9;
    if (sequence.pairs[i].stamp > sequence.pairs[i - 1].stamp)
      steps.push_back(step);
    else if (sequence.pairs[i].stamp < sequence.pairs[i - 1].stamp)
      ++backward;
  }
  const std::size_t all = sequence.pairs.size() - 1, still = all - backward - steps.size();
  if (2 * steps.size() < all && still > backward)
    refuse(file, 0,
           "has times of which {} of {} repeat the one before; write them with more digits", still,
           all);
  if (2 * steps.size() < all)
    refuse(file, 0,
           "has times that do not increase: of {} steps from pair to pair {} go back and {} are "
           "zero; sort the lines like the images, oldest first",
           all, backward, still);
  // The lower middle is used, because a gap does not indicate the unit.
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  if (*middle >= kShortestStep && *middle <= kLongestStep) return;
  if (*middle == 1e-9 && backward + still == 0)
    refuse(file, 0,
           "has frame numbers (1, 2, 3 …) instead of times; write times, or remove the file so "
           "that pairs are assumed 0.1 s apart");
  refuse(file, 0,
         "has a median interval of {:.4g} s between pairs, outside 1 ms to 10 s; check the unit of "
         "its times.{}",
         *middle,
         // Other formats have a fixed unit.
         file.extension() == ".txt"
             ? " Whole numbers are read as nanoseconds, numbers with a point as seconds"
             : "");
}

void check_image_sizes(const StereoSequence& sequence, std::size_t first, std::size_t count) {
  const std::size_t end =
      first + std::min(count, sequence.pairs.size() - std::min(first, sequence.pairs.size()));
  std::size_t good = 0, bad = 0;
  std::string message;
  for (std::size_t i = first; i < end; ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      const std::string& name = sequence.pairs[i].file[k];
      if (name.empty()) continue;
      ImageSize size;
      if (image_size(sequence, name, &size) != ImageFileStatus::ok) continue;
      const Intrinsics& camera = sequence.calibration.intrinsics[k];
      const ImageSize requested{(sequence.side_by_side ? 2 : 1) * camera.width, camera.height};
      ++(size == requested ? good : bad);
      if (size == requested || !message.empty()) continue;
      message = (sequence.root / name).string() + ": is " + text(size) +
                " pixels, but the calibration of this camera (" + sequence.calibration_source +
                ") is for " + text(requested) +
                (sequence.side_by_side ? " (twice its width, side by side)" : "") +
                "; use the calibration that belongs to these images";
    }
  // Single images of another size are skipped as frames.
  if (bad > good) throw InputError(message);
}

void find_deep_bits(StereoSequence* sequence) {
  if (sequence->pairs.empty()) return;
  std::vector<std::uint8_t> bytes;
  std::uint16_t peak = 0;
  for (std::size_t i = 0; i < kSampledPairs; ++i) {
    const StereoPair& pair =
        sequence->pairs[i * (sequence->pairs.size() - 1) / (kSampledPairs - 1)];
    for (const std::string& name : pair.file) {
      const auto found = find_peak(*sequence, name, &bytes);
      if (!found) return;
      peak = std::max(peak, *found);
    }
  }
  if (peak == 0) return;
  for (const int bits : {10, 12, 14})
    if (peak < 1U << static_cast<unsigned>(bits)) {
      sequence->deep_bits = bits;
      sequence->remarks.push_back(
          fmt::format("the images have 16 bits per sample, of which {} are used (largest sample: "
                      "{}): they are read as images of {} bits",
                      bits, peak, bits));
      return;
    }
}

}  // namespace vergence::app
