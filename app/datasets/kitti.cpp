#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/times_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

/// Where the benchmark has its grey images and its colour images, and which projections are theirs.
struct Cameras {
  std::array<const char*, 2> folders;
  std::array<int, 2> numbers;
};
constexpr Cameras kGrey{{"image_0", "image_1"}, {0, 1}}, kColour{{"image_2", "image_3"}, {2, 3}};

/// Number of an image by its name, `000123.png`.
std::size_t number_of(const fs::path& image) {
  const auto number = parse_integer(image.stem().string());
  if (!number || *number < 0) refuse(image, 0, "is not named by its frame, like 000000.png");
  return static_cast<std::size_t>(*number);
}

std::optional<std::size_t> index_of(const fs::path& image, std::size_t first, std::size_t count) {
  const std::size_t number = number_of(image);
  return number >= first && number - first < count ? std::optional(number - first) : std::nullopt;
}

/// One time per frame: those of times.txt, or the benchmark's frame rate without such a file.
std::vector<Stamp> times_of(StereoSequence* sequence, std::size_t frames) {
  std::vector<Stamp> times;
  if (!fs::exists(sequence->times)) {
    constexpr std::int64_t kStep = 100'000'000;  // ns
    for (std::size_t i = 0; i < frames; ++i)
      times.emplace_back(static_cast<std::int64_t>(i) * kStep);
    sequence->assumptions.emplace_back("there is no times.txt, so frames are 0.1 s apart");
    return times;
  }
  for (const TimesLine& line : read_times_file(sequence->times, TimeUnit::seconds).lines)
    times.push_back(line.stamp);
  return times;
}

/// The kind of pixels that a PNG says in its head.
bool is_colour(const fs::path& file) {
  constexpr std::size_t kKindAt = 25;
  constexpr std::uint8_t kColours = 2;  // bit of the kind
  std::vector<std::uint8_t> bytes;
  return read_image_file(file, &bytes) == ImageFileStatus::ok && bytes.size() > kKindAt &&
         bytes[0] == 0x89 && (bytes[kKindAt] & kColours) != 0;
}

}  // namespace

StereoSequence open_kitti(const fs::path& folder, bool given) {
  StereoSequence sequence;
  sequence.root = folder;
  sequence.times = folder / "times.txt";
  std::error_code ignored;
  const Cameras& cameras =
      !fs::exists(folder / kGrey.folders[0], ignored) && fs::exists(folder / kColour.folders[0])
          ? kColour
          : kGrey;
  if (&cameras == &kColour)
    sequence.assumptions.emplace_back("the colour images image_2 and image_3 are taken (P2, P3)");
  std::array<std::vector<std::string>, 2> images;
  std::size_t first = std::numeric_limits<std::size_t>::max(), last = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    images[k] = list_images(folder, cameras.folders[k]);
    for (const std::string& name : images[k]) {
      const std::size_t number = number_of(folder / name);
      first = std::min(first, number), last = std::max(last, number);
    }
  }
  constexpr std::size_t kMostFrames = 10'000'000;
  if (last - first >= kMostFrames)
    refuse(folder, 0, "has images whose numbers are further apart than any drive is long");
  const std::vector<Stamp> times = times_of(&sequence, last - first + 1);
  // An excerpt keeps its images' numbers, and its times.txt the lines of the whole drive, or its
  // own.
  const bool own_lines = !fs::exists(sequence.times, ignored) ||
                         (last >= times.size() && last - first + 1 == times.size());
  if (!own_lines) first = 0;
  if (own_lines && first > 0)
    sequence.assumptions.push_back(
        fmt::format("images begin with number {}, that of the first time", first));
  sequence.pairs.resize(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) sequence.pairs[i].stamp = times[i];
  for (std::size_t k = 0; k < 2; ++k) {
    for (const std::string& name : images[k]) {
      const auto index = index_of(folder / name, first, times.size());
      if (!index)
        refuse(folder / name, 0,
               fmt::format("has no line in times.txt, which ends with frame {}; the two do not "
                           "belong together",
                           times.size() - 1));
      sequence.pairs[*index].file[k] = name;
    }
    const fs::path pattern(images[k].front());
    for (std::size_t i = 0; i < times.size(); ++i)  // a file that is missing still has a name
      if (std::string& file = sequence.pairs[i].file[k]; file.empty())
        file = fmt::format("{}/{:0{}d}{}", cameras.folders[k], first + i,
                           pattern.stem().string().size(), pattern.extension().string());
  }
  if (&cameras == &kGrey && !given && is_colour(folder / images[0].front()))
    sequence.remarks.emplace_back(
        "image_0 and image_1 hold colour images, but P0 and P1 of calib.txt are those of the grey "
        "cameras: if these are image_2 and image_3 of the benchmark, P2 and P3 are theirs (give "
        "them with --calibration, or name the folders so)");
  if (given) return sequence;
  sequence.calibration = read_kitti_projections(folder / "calib.txt", cameras.numbers);
  sequence.calibration_source = "calib.txt";
  for (std::size_t k = 0; k < 2; ++k) {
    const ImageSize size = first_image_size(sequence, k);
    sequence.calibration.intrinsics[k].width = size.width;
    sequence.calibration.intrinsics[k].height = size.height;
  }
  return sequence;
}

}  // namespace vergence::app::detail
