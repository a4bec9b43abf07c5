#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/name_order.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/detail/side_names.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/times_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

/// The images of both cameras, in order of their names, and where they lie.
struct Images {
  std::array<std::string, 2> below{};               // the folders, relative to the drive's
  std::array<std::vector<std::string>, 2> names{};  // with their folder
  bool side_by_side = false;
};

std::string file_of(const std::string& name) { return fs::path(name).filename().string(); }
std::string stem_of(const std::string& name) { return fs::path(name).stem().string(); }

/// Images of both cameras in one folder, distinguished by the prefixes of their names.
std::optional<Images> images_by_prefix(const fs::path& root) {
  std::error_code ignored;
  std::vector<std::string> files;
  for (fs::directory_iterator it(root, ignored), end; !ignored && it != end; it.increment(ignored))
    if (is_image_name(it->path().filename().string()))
      files.push_back(it->path().filename().string());
  const std::array<std::string, 2> prefix = side_prefixes(files);
  if (prefix[0].empty()) return std::nullopt;
  Images images;
  for (const std::string& file : files)
    for (std::size_t k = 0; k < 2; ++k)
      if (file.starts_with(prefix[k])) images.names[k].push_back(file);
  for (auto& names : images.names) std::sort(names.begin(), names.end(), in_name_order);
  return images;
}

Images find_images(const fs::path& root) {
  Images images;
  if (const auto folders = camera_folders(root)) {
    images.below = *folders;
  } else {
    std::error_code ignored;
    images.side_by_side = fs::exists(root / "both", ignored);
    if (images.side_by_side)
      images.below = {"both", "both"};
    else if (auto together = images_by_prefix(root))
      return std::move(*together);
    else
      images.below = {"left", "right"};  // to be named as missing
  }
  for (std::size_t k = 0; k < 2; ++k) images.names[k] = list_images(root, images.below[k]);
  return images;
}

std::string in_folder(const Images& images, std::size_t k, const std::string& file) {
  return images.below[k].empty() ? file : images.below[k] + "/" + file;
}

// ---- pairs by names

/// The last number in a name, digits and points: `left_0012` → `0012`; empty: it has none.
std::string_view last_number(std::string_view stem) {
  constexpr std::string_view kDigits = "0123456789";
  const std::size_t last = stem.find_last_of(kDigits);
  if (last == std::string_view::npos) return {};
  stem = stem.substr(0, last + 1);
  const std::size_t before = stem.find_last_not_of("0123456789.");
  stem.remove_prefix(before == std::string_view::npos ? 0 : before + 1);
  return stem.substr(std::min(stem.find_first_of(kDigits), stem.size()));
}

/// The last number in a name without its leading zeros.
std::string number_key(const std::string& name) {
  const std::string stem = stem_of(name);
  const std::string_view number = last_number(stem);
  return std::string(number.substr(std::min(number.find_first_not_of('0'), number.size())));
}

/// Both sorted lists by their keys; equal ones meet, the others stand alone. A side that has no
/// image gets the name it should have had.
template <class Key>
std::vector<StereoPair> pair_by_key(const Images& images, const Key& key) {
  const auto& [left, right] = images.names;
  std::vector<StereoPair> pairs;
  std::size_t l = 0, r = 0;
  while (l < left.size() || r < right.size()) {
    const bool have_left =
        l < left.size() && (r == right.size() || !in_name_order(key(right[r]), key(left[l])));
    const bool have_right =
        r < right.size() && (l == left.size() || !in_name_order(key(left[l]), key(right[r])));
    StereoPair pair;
    pair.file[0] = have_left ? left[l] : in_folder(images, 0, file_of(right[r]));
    pair.file[1] = have_right ? right[r] : in_folder(images, 1, file_of(left[l]));
    l += have_left ? 1 : 0;
    r += have_right ? 1 : 0;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

std::size_t met(const Images& images, const std::vector<StereoPair>& pairs) {
  return images.names[0].size() + images.names[1].size() - pairs.size();
}

/// By equal names, else by equal last numbers, whichever half of the images agree on; nothing:
/// neither.
std::optional<std::vector<StereoPair>> pair_by_names(Images* images) {
  const std::size_t least = std::min(images->names[0].size(), images->names[1].size());
  auto pairs = pair_by_key(*images, stem_of);
  if (2 * met(*images, pairs) >= least) return pairs;
  Images numbered = *images;
  for (auto& names : numbered.names)
    std::stable_sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
      return in_name_order(number_key(a), number_key(b));
    });
  const auto unique = [](const std::vector<std::string>& names) {
    return std::adjacent_find(names.begin(), names.end(), [](const auto& a, const auto& b) {
             return number_key(a) == number_key(b);
           }) == names.end();
  };
  if (!unique(numbered.names[0]) || !unique(numbered.names[1])) return std::nullopt;
  pairs = pair_by_key(numbered, number_key);
  if (2 * met(numbered, pairs) < least) return std::nullopt;
  *images = std::move(numbered);
  return pairs;
}

std::vector<StereoPair> pair_in_order(const Images& images) {
  std::vector<StereoPair> pairs(images.names[0].size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].file = {images.names[0][i], images.names[1][i]};
  return pairs;
}

// ---- pairs by stamps in names

/// The times that the names are; nothing: they are none.
std::optional<std::vector<Stamp>> stamps_in(const std::vector<std::string>& names,
                                            std::string* unit) {
  std::vector<std::string> stems;
  for (const std::string& name : names) stems.push_back(stem_of(name));
  std::vector<std::string_view> numbers;
  for (const std::string& stem : stems) numbers.push_back(last_number(stem));
  const TimeForm form = find_time_form(numbers, std::nullopt, TimeUnit::nanoseconds);
  if (!form.absolute || form.iso) return std::nullopt;
  std::vector<Stamp> stamps;
  for (const std::string_view number : numbers) {
    const auto stamp = read_time(number, form);
    if (!stamp) return std::nullopt;
    stamps.push_back(*stamp);
  }
  *unit = to_string(form.unit);
  return stamps;
}

/// By the nearest stamp; nothing: names are no stamps.
std::optional<std::vector<StereoPair>> pair_by_stamps(const Images& images,
                                                      std::vector<std::string>* assumptions) {
  std::string unit;
  const auto left = stamps_in(images.names[0], &unit), right = stamps_in(images.names[1], &unit);
  if (!left || !right) return std::nullopt;
  std::vector<StereoPair> pairs = merged_pairs(
      *left, *right, [&](std::size_t k, std::size_t i) { return images.names[k][i]; }, assumptions);
  if (pairs.size() == left->size() + right->size()) return std::nullopt;
  assumptions->push_back("times are the " + unit + " in the images' names");
  return pairs;
}

// ---- times

/// Interval assumed without a times.txt. Motion is predicted by frames, so a wrong rate affects
/// stamps and not poses.
constexpr std::int64_t kAssumedStep = 100'000'000;  // ns

std::optional<fs::path> times_of(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : {"times.txt", "timestamps.txt", "times.csv", "timestamps.csv"})
    if (fs::exists(folder / name, ignored)) return folder / name;
  return std::nullopt;
}

/// Images as the lines name them; some may be missing, but not all of a side.
std::vector<StereoPair> pair_as_named(const fs::path& file, const std::vector<TimesLine>& times,
                                      const Images& images) {
  std::vector<StereoPair> pairs(times.size());
  for (std::size_t i = 0; i < times.size(); ++i)
    pairs[i] = {times[i].stamp,
                {in_folder(images, 0, times[i].name[0]), in_folder(images, 1, times[i].name[1])}};
  for (std::size_t k = 0; k < 2; ++k)
    if (std::none_of(pairs.begin(), pairs.end(), [&](const StereoPair& pair) {
          return std::binary_search(images.names[k].begin(), images.names[k].end(), pair.file[k],
                                    in_name_order);
        }))
      refuse(file, 0,
             "names no image that is there: the first is " + pairs.front().file[k] +
                 ", the folder has " + images.names[k].front());
  return pairs;
}

/// Image N belongs to line N, counted from 0 or from 1; nothing: a name has no number of a line.
std::optional<std::vector<StereoPair>> pair_by_number(const std::vector<StereoPair>& pairs,
                                                      std::size_t lines) {
  std::vector<std::size_t> numbers;
  for (const StereoPair& pair : pairs) {
    const std::string key = number_key(pair.file[0]);
    const auto n = key.empty() ? std::optional<std::int64_t>(0) : parse_integer(key);
    if (!n || *n < 0 || *n > static_cast<std::int64_t>(lines)) return std::nullopt;
    numbers.push_back(static_cast<std::size_t>(*n));
  }
  const std::size_t first = *std::max_element(numbers.begin(), numbers.end()) == lines ? 1 : 0;
  if (*std::min_element(numbers.begin(), numbers.end()) < first) return std::nullopt;
  std::vector<StereoPair> all(lines);
  for (std::size_t i = 0; i < pairs.size(); ++i) all[numbers[i] - first].file = pairs[i].file;
  return all;
}

/// By names, where these give as many pairs as there are times: a name that only one side has is an
/// image that the other lost. Where both lost one, by the numbers in the names: image N has line N.
/// Else in order of name, where there is one of each a pair.
std::vector<StereoPair> pair_with_times(const fs::path& folder, const std::vector<TimesLine>& times,
                                        Images* images, std::vector<std::string>* assumptions) {
  const auto& [left, right] = images->names;
  std::vector<StereoPair> pairs = pair_by_names(images).value_or(std::vector<StereoPair>{});
  if (pairs.size() != times.size() && left.size() == right.size() && left.size() == times.size())
    pairs = pair_in_order(*images);
  if (!pairs.empty() && pairs.size() < times.size())
    if (auto numbered = pair_by_number(pairs, times.size())) {
      pairs = std::move(*numbered);
      assumptions->emplace_back(
          "there are fewer pairs than times: an image belongs to the line of its number");
    }
  if (pairs.size() != times.size())
    refuse(
        folder, 0,
        fmt::format("has {} left images, {} right ones and {} lines in its list of times; one of "
                    "each a pair is expected (a line may name its image: stamp,file)",
                    left.size(), right.size(), times.size()));
  for (std::size_t i = 0; i < times.size(); ++i) pairs[i].stamp = times[i].stamp;
  return pairs;
}

std::vector<StereoPair> pair_without_times(const fs::path& folder, Images* images,
                                           std::vector<std::string>* assumptions) {
  if (auto stamped = pair_by_stamps(*images, assumptions)) return std::move(*stamped);
  const auto& [left, right] = images->names;
  auto named = pair_by_names(images);
  if (!named && left.size() != right.size())
    refuse(folder, 0,
           fmt::format("has {} left images and {} right ones, whose names have no numbers in "
                       "common; give the images of a pair one name, or write a times.txt whose "
                       "lines name them: stamp,left file,right file",
                       left.size(), right.size()));
  std::vector<StereoPair> pairs = named ? std::move(*named) : pair_in_order(*images);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].stamp = Stamp(static_cast<std::int64_t>(i) * kAssumedStep);
  assumptions->emplace_back(
      "there is no times.txt, so pairs are 0.1 s apart (write one line a pair: the time)");
  return pairs;
}

}  // namespace

bool holds_stereo_images(const fs::path& root) {
  return camera_folders(root).has_value() || images_by_prefix(root).has_value();
}

StereoSequence open_folder(const fs::path& folder, bool given, const CalibrationUse& use) {
  StereoSequence sequence;
  sequence.root = folder;
  Images images = find_images(folder);
  // Images in DRIVE/left and DRIVE/right below the folder: the calibration and the times are
  // theirs.
  if (const fs::path parent = fs::path(images.below[0]).parent_path();
      !parent.empty() && parent == fs::path(images.below[1]).parent_path() &&
      !fs::exists(folder / "calibration.yaml"))
    return open_folder(folder / parent, given, use);
  sequence.side_by_side = images.side_by_side;
  if (images.side_by_side ? images.below[0] != "both" : images.below[0] != "left")
    sequence.assumptions.push_back(fmt::format("{} is left and {} is right",
                                               images.names[0].front(), images.names[1].front()));
  sequence.times = folder / "times.txt";
  if (const auto file = times_of(folder)) {
    sequence.times = *file;
    const TimesFile times = read_times_file(*file);
    sequence.assumptions.insert(sequence.assumptions.end(), times.remarks.begin(),
                                times.remarks.end());
    sequence.pairs = times.lines.front().name[0].empty()
                         ? pair_with_times(folder, times.lines, &images, &sequence.assumptions)
                         : pair_as_named(*file, times.lines, images);
  } else {
    sequence.pairs = pair_without_times(folder, &images, &sequence.assumptions);
  }
  if (const auto& [left, right] = images.names; left.size() != right.size())
    sequence.remarks.push_back(fmt::format(
        "there are {} left images and {} right ones: where one camera lost an image without "
        "leaving a gap in the names or in times.txt, all pairs after it are a frame off; check "
        "that the names of a pair belong together",
        left.size(), right.size()));
  if (given) return sequence;
  if (!fs::exists(folder / "calibration.yaml"))
    refuse(
        folder, 0,
        "has no calibration.yaml; give a calibration with --calibration (of vergence, Kalibr, ROS, "
        "OpenCV or another program), or --focal and --baseline");
  sequence.calibration = read_calibration(folder / "calibration.yaml", use).rig;
  sequence.calibration_source = "calibration.yaml";
  return sequence;
}

}  // namespace vergence::app::detail
