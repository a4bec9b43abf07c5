#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/foreign_calibration.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/times_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

/// Images of one camera in the order of their names.
struct Camera {
  // Directory relative to the data set.
  std::string below{};
  // Names with their directory.
  std::vector<std::string> names{};
  // Word in lower case that identifies the camera in a name.
  std::string side{};
  [[nodiscard]] std::string in_folder(const std::string& file) const {
    return below.empty() ? file : below + "/" + file;
  }
};
using Cameras = std::array<Camera, 2>;

// ---- where the images are

std::vector<std::string> list_names(const fs::path& folder, bool folders) {
  std::vector<std::string> names;
  for (const fs::path& entry : entries_in(folder)) {
    const std::string name = entry.filename().string();
    std::error_code ignored;
    if (folders ? fs::is_directory(entry, ignored) && !name.starts_with('.') : is_image_name(name))
      names.push_back(name);
  }
  return names;
}

/// Two directories with the usual names that contain images, directly or in a subdirectory of the
/// same name.
std::optional<Cameras> in_two_folders(const fs::path& root, const std::string& above) {
  for (const auto& [left, right] : stereo_names(list_names(root / above, true))) {
    std::vector<std::string> inner = list_names(root / above / left, true);
    inner.insert(inner.begin(), "");
    for (const std::string& name : inner) {
      const std::string below = name.empty() ? "" : "/" + name;
      if (!list_names(root / (above + left + below), false).empty() &&
          !list_names(root / (above + right + below), false).empty())
        return Cameras{Camera{above + left + below}, Camera{above + right + below}};
    }
  }
  return std::nullopt;
}

/// Images of both cameras in one folder, distinguished by a word of their names.
std::optional<Cameras> in_one_folder(const fs::path& root, const std::string& above) {
  const std::vector<std::string> files = list_names(root / above, false);
  const std::array<std::string, 2> sides = side_names(files);
  if (sides[0].empty()) return std::nullopt;
  Cameras cameras;
  for (std::size_t k = 0; k < 2; ++k) {
    cameras[k].below = above.substr(0, above.empty() ? 0 : above.size() - 1);
    cameras[k].side = sides[k];
    for (const std::string& file : files)
      if (without_side(file, sides[k]) && !without_side(file, sides[1 - k]))
        cameras[k].names.push_back(cameras[k].in_folder(file));
  }
  return cameras;
}

std::optional<Cameras> read_cameras(const fs::path& root, const std::string& above) {
  auto cameras = in_two_folders(root, above);
  return cameras ? cameras : in_one_folder(root, above);
}

/// Searches the directory, or else the only subdirectory that contains both cameras.
std::optional<Cameras> find_cameras(const fs::path& root) {
  std::optional<Cameras> found = read_cameras(root, "");
  if (found) return found;
  for (const std::string& name : list_names(root, true)) {
    auto cameras = read_cameras(root, name + "/");
    if (cameras && found) return std::nullopt;
    if (cameras) found = std::move(cameras);
  }
  return found;
}

/// Throws InputError if the directory is missing or has no readable image.
std::vector<std::string> list_images(const fs::path& root, const std::string& below) {
  const fs::path folder = root / below;
  require_folder(folder, "images");
  std::vector<std::string> names = list_names(folder, false);
  if (names.empty()) {
    // Advice by the extension of a file that cannot be read.
    std::string advice;
    std::error_code error;
    for (const fs::path& file : entries_in(folder, &error))
      if (file.has_extension() && file.stem() != "")
        advice = fmt::format(
            "; {0} files are not supported: convert them, for example with `mogrify -format png "
            "*{0}`",
            file.extension().string());
    if (error) refuse(folder, 0, "cannot be listed ({}): check its permissions", error.message());
    refuse(folder, 0, "holds no PNG, JPEG, BMP or PGM image{}", advice);
  }
  for (std::string& name : names) name = below.empty() ? name : below + "/" + name;
  return names;
}

Cameras cameras_in(const fs::path& root, const std::array<std::string, 2>& below) {
  Cameras cameras;
  for (std::size_t k = 0; k < 2; ++k)
    cameras[k].below = below[k], cameras[k].names = list_images(root, below[k]);
  return cameras;
}

// ---- what names tell

/// Name without its extension and without the word that identifies the camera.
std::string to_stem(const Camera& camera, const std::string& name) {
  const std::string stem = fs::path(name).stem().string();
  return camera.side.empty() ? stem : without_side(stem, camera.side).value_or(stem);
}

/// Last number in a name, with digits and points: `left_0012` gives `0012`; empty if there is none.
std::string_view last_number(std::string_view stem) {
  constexpr std::string_view kDigits = "0123456789";
  const std::size_t last = stem.find_last_of(kDigits);
  if (last == std::string_view::npos) return {};
  stem = stem.substr(0, last + 1);
  const std::size_t before = stem.find_last_not_of("0123456789.");
  stem.remove_prefix(before == std::string_view::npos ? 0 : before + 1);
  return stem.substr(std::min(stem.find_first_of(kDigits), stem.size()));
}

/// Last number in a name without its leading zeros.
std::string number_key(const Camera& camera, const std::string& name) {
  const std::string stem = to_stem(camera, name);
  const std::string_view number = last_number(stem);
  return std::string(number.substr(std::min(number.find_first_not_of('0'), number.size())));
}

std::optional<std::size_t> parse_index(const Camera& camera, const std::string& name) {
  const auto n = parse_integer(last_number(to_stem(camera, name)));
  return n && *n >= 0 ? std::optional(static_cast<std::size_t>(*n)) : std::nullopt;
}

/// Time in a name: the complete name as a date and time, seconds and the digits after their point
/// (`1403636584_763555584`), or the last number.
std::string time_in(const std::string& stem) {
  if (parse_iso_time(stem)) return stem;
  const std::string_view number = last_number(stem);
  const std::string_view before =
      std::string_view(stem).substr(0, static_cast<std::size_t>(number.data() - stem.data()));
  const bool parts = (number.size() == 9 || number.size() == 6) && before.size() > 10 &&
                     (before.back() == '_' || before.back() == '-') &&
                     last_number(before).size() == 10;
  return (parts ? std::string(last_number(before)) + "." : "") + std::string(number);
}

/// Times according to the names; empty if the names have none.
std::optional<std::vector<Stamp>> stamps_in(const Camera& camera, std::string* unit) {
  std::vector<std::string> texts;
  for (const std::string& name : camera.names) texts.push_back(time_in(to_stem(camera, name)));
  const std::vector<std::string_view> numbers(texts.begin(), texts.end());
  const TimeForm form = find_time_form(numbers, std::nullopt, TimeUnit::nanoseconds);
  if (!form.absolute) return std::nullopt;
  std::vector<Stamp> stamps;
  for (const std::string_view number : numbers) {
    const auto stamp = read_time(number, form);
    if (!stamp) return std::nullopt;
    stamps.push_back(*stamp);
  }
  *unit = form.iso ? "date and time" : to_string(form.unit);
  return stamps;
}

// ---- pairs by names

/// Pairs by equal keys, in their order. If one side lacks an image, it gets the name that the image
/// should have. Empty if a camera has a key twice, or fewer than half of the images match.
template <class Key>
std::optional<std::vector<StereoPair>> pair_by_key(const Cameras& cameras, const Key& key) {
  std::map<std::string, StereoPair, bool (*)(std::string_view, std::string_view)> by_key(
      in_name_order);
  for (std::size_t k = 0; k < 2; ++k)
    for (const std::string& name : cameras[k].names) {
      std::string& file = by_key[key(cameras[k], name)].file[k];
      if (!file.empty()) return std::nullopt;
      file = name;
    }
  const std::size_t left = cameras[0].names.size(), right = cameras[1].names.size();
  if (2 * (left + right - by_key.size()) < std::min(left, right)) return std::nullopt;
  std::vector<StereoPair> pairs;
  for (auto& [ignored, pair] : by_key) {
    for (std::size_t k = 0; k < 2; ++k)
      if (pair.file[k].empty() && cameras[k].side.empty())
        pair.file[k] = cameras[k].in_folder(fs::path(pair.file[1 - k]).filename().string());
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

/// Pairs by equal names, or else by equal last numbers.
std::optional<std::vector<StereoPair>> pair_by_names(const Cameras& cameras) {
  auto pairs = pair_by_key(cameras, to_stem);
  return pairs ? pairs : pair_by_key(cameras, number_key);
}

std::vector<StereoPair> pair_in_order(const Cameras& cameras) {
  std::vector<StereoPair> pairs(cameras[0].names.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].file = {cameras[0].names[i], cameras[1].names[i]};
  return pairs;
}

// ---- pairs by stamps

/// Images with their stamps, in the order of their list.
struct Stamped {
  std::vector<Stamp> stamps{};
  std::vector<std::string> names{};
};

/// Pairs of the nearest stamps, within kMaxApart of the interval, in the order of the left ones.
/// Empty if there is no pair.
std::optional<std::vector<StereoPair>> pair_by_stamps(const std::array<Stamped, 2>& cameras,
                                                      StereoSequence* sequence) {
  const auto &left = cameras[0].stamps, &right = cameras[1].stamps;
  const Duration interval = usual_interval(left);
  const auto together =
      pair_nearest(left, right, Duration::seconds(kMaxApart * interval.to_seconds()));
  if (together.empty()) return std::nullopt;
  const PairOffset offset = pair_offset(left, right, together);
  if (offset.farthest > Duration{})
    sequence->assumptions.push_back(
        "images are paired by the nearest stamp; right ones are later by " + describe(offset));
  const std::size_t alone = left.size() + right.size() - 2 * together.size();
  sequence->left_out += alone;
  remark_pairs("left images", "right images", offset, interval, alone, &sequence->remarks);
  std::vector<StereoPair> pairs;
  for (const auto& [l, r] : together)
    pairs.push_back({left[l], {cameras[0].names[l], cameras[1].names[r]}});
  return pairs;
}

// ---- lists of times

/// Layout of a data set's times.
struct Lists {
  // List of both cameras.
  std::optional<fs::path> shared{};
  // List of each camera.
  std::array<std::optional<fs::path>, 2> own{};
  // Fixed unit of times that do not count from 1970.
  std::optional<TimeUnit> unit{};
  // True if line N is that of image N, counted from 0.
  bool by_number = false;
};

/// `name_of_euroc` is EuRoC's name of the list in a camera's directory; elsewhere it may be another
/// file.
std::optional<fs::path> list_in(const fs::path& folder, const char* name_of_euroc = "times.txt") {
  for (const char* name :
       {"times.txt", "timestamps.txt", "times.csv", "timestamps.csv", name_of_euroc})
    if (present(folder / name)) return folder / name;
  return std::nullopt;
}

/// Searches next to the image directories, in them, and in between.
Lists find_lists(const fs::path& root, const Cameras& cameras) {
  Lists lists{.shared = list_in(root)};
  for (std::size_t k = 0; k < 2; ++k) {
    const fs::path folder = root / cameras[k].below;
    lists.own[k] = list_in(folder, "data.csv");
    if (!lists.own[k] && cameras[k].below.find('/') != std::string::npos)
      lists.own[k] = list_in(folder.parent_path(), "data.csv");
  }
  if (!lists.shared && (lists.own[0] == lists.own[1] || !lists.own[1])) lists.shared = lists.own[0];
  return lists;
}

TimesFile read_list(const fs::path& file, const Lists& lists, StereoSequence* sequence) {
  TimesFile times = read_times_file(file, lists.unit);
  auto& assumptions = sequence->assumptions;
  for (const std::string& remark : times.remarks)
    if (std::ranges::find(assumptions, remark) == assumptions.end()) assumptions.push_back(remark);
  return times;
}

/// Image that a line names with or without its extension.
std::string named(const Camera& camera, const std::string& name) {
  const fs::path first(camera.names.empty() ? "" : camera.names.front());
  return camera.in_folder(is_image_name(name) ? name : name + first.extension().string());
}

bool holds(const Camera& camera, const std::string& name) {
  return std::binary_search(camera.names.begin(), camera.names.end(), name, in_name_order);
}

/// Images of a camera with the stamps of its own list.
Stamped stamped(const fs::path& root, const Camera& camera, const fs::path& list,
                const Lists& lists, StereoSequence* sequence) {
  const TimesFile times = read_list(list, lists, sequence);
  Stamped out;
  const auto push = [&out](Stamp stamp, const std::string& name) {
    out.stamps.push_back(stamp);
    out.names.push_back(name);
  };
  std::string unit;
  if (!times.lines.front().name[0].empty()) {
    for (const TimesLine& line : times.lines) push(line.stamp, named(camera, line.name[0]));
    return out;
  }
  if (const auto stamps = stamps_in(camera, &unit)) return {*stamps, camera.names};
  std::vector<std::string> of_line(times.lines.size());
  std::size_t end = 0, odd = 0, without = 0;
  for (const std::string& name : camera.names) {
    const auto number = parse_index(camera, name);
    if (number && *number < of_line.size())
      of_line[*number] = name, end = std::max(end, *number + 1);
    else
      ++(number ? without : odd);
  }
  if (end == 0)
    refuse(list, 0,
           "has no line for any image: line N must be image N; check that list and images belong "
           "together");
  for (std::size_t i = 0; i < end; ++i) push(times.lines[i].stamp, of_line[i]);
  const auto add_remark = [&](std::size_t n, const char* what) {
    if (n > 0)
      sequence->remarks.push_back(
          fmt::format("{}: {} {}", list.lexically_relative(root).string(), n, what));
  };
  add_remark(odd, "images have no number in their name and are skipped");
  add_remark(without, "images have no line and are skipped");
  add_remark(of_line.size() - end, "lines follow the last image");
  sequence->left_out += odd + without;
  return out;
}

/// Images as named in the lines. Some may be missing, but not all of one side.
std::vector<StereoPair> pair_as_named(const fs::path& file, const std::vector<TimesLine>& times,
                                      const Cameras& cameras) {
  std::vector<StereoPair> pairs;
  std::array<bool, 2> any{};
  for (const TimesLine& line : times) {
    StereoPair& pair = pairs.emplace_back(line.stamp);
    for (std::size_t k = 0; k < 2; ++k) {
      pair.file[k] = named(cameras[k], line.name[k]);
      any[k] = any[k] || holds(cameras[k], pair.file[k]);
    }
  }
  for (std::size_t k = 0; k < 2; ++k)
    if (!any[k])
      refuse(file, 0, "names no existing image; its first name is {}, the directory has {}",
             pairs.front().file[k], cameras[k].names.front());
  return pairs;
}

/// Numbers of pairs according to their names; empty if a name has none.
std::vector<std::size_t> parse_indices(const Cameras& cameras,
                                       const std::vector<StereoPair>& pairs) {
  std::vector<std::size_t> numbers;
  for (const StereoPair& pair : pairs) {
    const std::size_t k = pair.file[0].empty() ? 1 : 0;
    const auto n = parse_index(cameras[k], pair.file[k]);
    if (!n) return {};
    numbers.push_back(*n);
  }
  return numbers;
}

/// Assigns image N to line N, counted from 0 or 1; empty if a number exceeds the lines.
std::vector<StereoPair> pair_by_number(const std::vector<std::size_t>& numbers,
                                       const std::vector<StereoPair>& pairs, std::size_t lines) {
  if (numbers.empty()) return {};
  const auto [least, most] = std::ranges::minmax(numbers);
  const std::size_t first = most == lines ? 1 : 0;
  if (most > lines || least < first) return {};
  std::vector<StereoPair> all(lines);
  for (std::size_t i = 0; i < pairs.size(); ++i) all[numbers[i] - first].file = pairs[i].file;
  return all;
}

/// Pairs by names if these give as many pairs as there are times; a name on one side only is then
/// an image that the other side lost. If both sides lost one, image N gets line N. Otherwise pairs
/// in the order of names, if both sides have one image per time.
std::vector<StereoPair> pair_with_times(const fs::path& folder, const std::vector<TimesLine>& times,
                                        bool by_number, const Cameras& cameras,
                                        std::vector<std::string>* assumptions) {
  const std::size_t left = cameras[0].names.size(), right = cameras[1].names.size();
  std::vector<StereoPair> pairs = pair_by_names(cameras).value_or(std::vector<StereoPair>{});
  const auto numbers = parse_indices(cameras, pairs);
  const bool run = !numbers.empty() && numbers.back() - numbers.front() + 1 == pairs.size();
  if (run && numbers.front() > 1 && pairs.size() == times.size())
    assumptions->push_back(
        fmt::format("images begin with number {}, that of the first time", numbers.front()));
  // Without names there must be one line per frame, including lost ones.
  const bool whole = pairs.size() == times.size() && !(by_number && !run);
  if (!whole && !by_number && left == right && left == times.size()) {
    pairs = pair_in_order(cameras);
  } else if (!whole && pairs.size() <= times.size()) {
    pairs = pair_by_number(numbers, pairs, times.size());
    if (!pairs.empty() && !by_number)
      assumptions->emplace_back(
          "there are fewer pairs than times: each image gets the line of its number");
  }
  if (pairs.size() != times.size())
    refuse(folder, 0,
           "has {} left images, {} right ones and {} lines in its list of times; the numbers must "
           "be equal, or each line must name its image: stamp,file",
           left, right, times.size());
  for (std::size_t i = 0; i < times.size(); ++i) pairs[i].stamp = times[i].stamp;
  return pairs;
}

/// Interval assumed without a list of times. Motion is predicted by frames, so a wrong rate affects
/// stamps and not poses.
// In ns.
constexpr std::int64_t kAssumedStep = 100'000'000;

std::vector<StereoPair> pair_without_times(const fs::path& folder, const Cameras& cameras,
                                           StereoSequence* sequence) {
  std::string unit;
  const auto left = stamps_in(cameras[0], &unit), right = stamps_in(cameras[1], &unit);
  if (left && right)
    if (auto pairs = pair_by_stamps(
            {Stamped{*left, cameras[0].names}, Stamped{*right, cameras[1].names}}, sequence)) {
      sequence->assumptions.push_back("times are the " + unit + " in the images' names");
      return std::move(*pairs);
    }
  auto named = pair_by_names(cameras);
  const auto &of_left = cameras[0].names, &of_right = cameras[1].names;
  if (!named && of_left.size() != of_right.size())
    refuse(folder, 0,
           "has {} left images and {} right ones without common numbers in their names; give both "
           "images of a pair the same name, or write a times.txt that names them: stamp,left "
           "file,right file",
           of_left.size(), of_right.size());
  std::vector<StereoPair> pairs = named ? std::move(*named) : pair_in_order(cameras);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].stamp = Stamp(static_cast<std::int64_t>(i) * kAssumedStep);
  sequence->assumptions.emplace_back(
      "there is no times.txt, so pairs are assumed 0.1 s apart (it has the time of one pair per "
      "line)");
  return pairs;
}

void pair_cameras(const Cameras& cameras, const Lists& lists, StereoSequence* sequence) {
  const fs::path& root = sequence->root;
  if (!lists.shared && lists.own[0] && lists.own[1]) {
    sequence->times = *lists.own[0];
    auto pairs = pair_by_stamps({stamped(root, cameras[0], *lists.own[0], lists, sequence),
                                 stamped(root, cameras[1], *lists.own[1], lists, sequence)},
                                sequence);
    if (!pairs)
      refuse(*lists.own[1], 0,
             "has no stamp close to one of {}; check that both lists are of the same recording",
             lists.own[0]->string());
    sequence->pairs = std::move(*pairs);
    return;
  }
  if (!lists.shared) {
    sequence->pairs = pair_without_times(root, cameras, sequence);
    return;
  }
  sequence->times = *lists.shared;
  TimesFile times = read_list(*lists.shared, lists, sequence);
  // Two numbers may be the times of both images instead of names.
  const std::string& name = times.lines.front().name[0];
  double ignored = 0;
  const bool named_there = !name.empty() && (!parse_number(name, &ignored) ||
                                             holds(cameras[0], named(cameras[0], name)));
  sequence->pairs = named_there ? pair_as_named(*lists.shared, times.lines, cameras)
                                : pair_with_times(root, times.lines, lists.by_number, cameras,
                                                  &sequence->assumptions);
}

// ---- calibrations

void read_own_calibration(const CalibrationUse& use, const Cameras& cameras,
                          StereoSequence* sequence) {
  const fs::path& folder = sequence->root;
  if (present(folder / "calibration.yaml")) {
    sequence->calibration = read_calibration(folder / "calibration.yaml", use).rig;
    sequence->calibration_source = "calibration.yaml";
    return;
  }
  std::array<fs::path, 2> sensors;
  for (std::size_t k = 0; k < 2; ++k)
    sensors[k] = (folder / cameras[k].below).parent_path() / "sensor.yaml";
  if (sensors[0] != sensors[1] && present(sensors[0]) && present(sensors[1])) {
    const auto text = [](const fs::path& file) {
      return CalibrationText{file.string(), read_text(file, kLargestYaml)};
    };
    sequence->calibration = parse_any_calibration({text(sensors[0]), text(sensors[1])},
                                                  std::nullopt, &sequence->remarks)
                                .rig;
    sequence->calibration_source = sensors[1].lexically_relative(folder).string();
    return;
  }
  // A file that may be a calibration of another program.
  std::string other;
  for (const fs::path& entry : entries_in(folder))
    for (const char* ending : {".yaml", ".yml", ".json", ".xml"})
      if (const std::string name = entry.filename().string();
          other.empty() && (lower(name).ends_with(ending) || name.starts_with("calib")))
        other = name;
  refuse(folder, 0,
         "has no calibration.yaml; pass a calibration with --calibration (of vergence, Kalibr, "
         "ROS, OpenCV or another program), or --focal and --baseline{}",
         other.empty() ? "" : "; is " + other + " one?");
}

/// True if the file is a PNG with colours.
bool is_colour(const fs::path& file) {
  constexpr std::size_t kKindAt = 25;
  // Bit of the colour type.
  constexpr std::uint8_t kColours = 2;
  std::vector<std::uint8_t> bytes;
  return read_image_file(file, &bytes) == ImageFileStatus::ok && bytes.size() > kKindAt &&
         bytes[0] == 0x89 && (bytes[kKindAt] & kColours) != 0;
}

}  // namespace

bool holds_stereo_images(const fs::path& root) { return find_cameras(root).has_value(); }

// NOLINTNEXTLINE(misc-no-recursion): a folder deeper each time
StereoSequence open_folder(const fs::path& folder, bool given, const CalibrationUse& use) {
  StereoSequence sequence{.root = folder, .side_by_side = present(folder / "both")};
  Cameras cameras;
  if (sequence.side_by_side)
    for (Camera& camera : cameras) camera.below = "both";
  else if (auto found = find_cameras(folder))
    cameras = std::move(*found);
  else
    // Left and right are reported as missing.
    for (std::size_t k = 0; k < 2; ++k) cameras[k].below = k == 0 ? "left" : "right";
  // If the images are in DRIVE/left and DRIVE/right, DRIVE also has their calibration and times.
  if (const fs::path parent = fs::path(cameras[0].below).parent_path();
      !parent.empty() && parent == fs::path(cameras[1].below).parent_path() &&
      !present(folder / "calibration.yaml") && !list_in(folder))
    return open_folder(folder / parent, given, use);
  for (Camera& camera : cameras)
    if (camera.names.empty()) camera.names = list_images(folder, camera.below);
  if (!sequence.side_by_side && cameras[0].below != "left")
    sequence.assumptions.push_back(fmt::format("{} is left and {} is right",
                                               cameras[0].names.front(), cameras[1].names.front()));
  sequence.times = folder / "times.txt";
  pair_cameras(cameras, find_lists(folder, cameras), &sequence);
  // Images without a partner by their stamps are reported already.
  if (const auto& left = cameras[0].names, &right = cameras[1].names;
      left.size() != right.size() && sequence.left_out == 0)
    sequence.remarks.push_back(
        fmt::format("there are {} left images and {} right ones: if one camera lost an image "
                    "without a gap in the names, all later pairs are one frame off; check that the "
                    "names of a pair belong together",
                    left.size(), right.size()));
  if (!given) read_own_calibration(use, cameras, &sequence);
  return sequence;
}

StereoSequence open_euroc(const fs::path& folder, bool given, const CalibrationUse& use) {
  StereoSequence sequence{.root = fs::is_directory(folder / "mav0") ? folder / "mav0" : folder};
  for (const char* camera : {"cam0", "cam1"})
    require_folder(sequence.root / camera, "data.csv, sensor.yaml and data/ of that camera");
  Cameras cameras = cameras_in(sequence.root, {"cam0/data", "cam1/data"});
  Lists lists = find_lists(sequence.root, cameras);
  lists.unit = TimeUnit::nanoseconds;
  pair_cameras(cameras, lists, &sequence);
  if (!given) read_own_calibration(use, cameras, &sequence);
  return sequence;
}

StereoSequence open_kitti(const fs::path& folder, bool given) {
  StereoSequence sequence{.root = folder};
  const bool colour = !present(folder / "image_0") && present(folder / "image_2");
  if (colour)
    sequence.assumptions.emplace_back(
        "the colour images image_2 and image_3 are used, with P2 and P3");
  Cameras cameras =
      cameras_in(folder, {colour ? "image_2" : "image_0", colour ? "image_3" : "image_1"});
  Lists lists = find_lists(folder, cameras);
  lists.unit = TimeUnit::seconds;
  lists.by_number = true;
  pair_cameras(cameras, lists, &sequence);
  if (!colour && !given && is_colour(folder / cameras[0].names.front()))
    sequence.remarks.emplace_back(
        "image_0 and image_1 hold colour images, but P0 and P1 of calib.txt are of the grey "
        "cameras; if these are image_2 and image_3 of the benchmark, rename the directories so "
        "that P2 and P3 are used");
  if (given) return sequence;
  sequence.calibration =
      read_kitti_projections(folder / "calib.txt", colour ? std::array{2, 3} : std::array{0, 1},
                             first_image_size(sequence, 0));
  sequence.calibration_source = "calib.txt";
  return sequence;
}

StereoSequence open_kitti_raw(const fs::path& folder, bool given,
                              const std::array<int, 2>& numbers) {
  if (numbers[0] == numbers[1])
    refuse(folder, 0,
           "kitti_raw.left and kitti_raw.right are both camera {}; choose two different cameras",
           numbers[0]);
  const KittiRawFolders folders = find_kitti_raw(folder);
  StereoSequence sequence{.root = folders.drive};
  std::array<std::string, 2> below;
  Lists lists;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string camera = fmt::format("image_{:02d}", numbers[k]);
    require_folder(
        folders.drive / camera,
        "data/ and timestamps.txt of a camera (selected by kitti_raw.left and kitti_raw.right)");
    below[k] = camera + "/data";
    lists.own[k] = folders.drive / camera / "timestamps.txt";
  }
  Cameras cameras = cameras_in(folders.drive, below);
  pair_cameras(cameras, lists, &sequence);
  if (given) return sequence;
  sequence.calibration = read_kitti_raw_rig(folders, numbers, first_image_size(sequence, 0)).rig;
  sequence.calibration_source = kKittiRawCalibration;
  return sequence;
}

}  // namespace vergence::app::detail
