#include <algorithm>
#include <array>
#include <span>

#include "app/config/calibration_file.hpp"
#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/name_order.hpp"
#include "app/datasets/exif.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

/// A line of times.txt: `stamp`, `stamp,file` (of that name on both sides) or `stamp,left
/// file,right file`.
struct Line {
  Stamp stamp{};
  std::array<std::string, 2> name{};  // empty: by order
};

std::array<std::string, 2> names_of(const std::filesystem::path& file, std::size_t line,
                                    std::span<const std::string_view> fields) {
  std::array<std::string, 2> names;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string_view name = fields[std::min(k + 1, fields.size() - 1)];
    if (name.empty() || name == "." || name == ".." || name.find('/') != std::string_view::npos)
      refuse(
          file, line,
          "`" + std::string(name.substr(0, 40)) + "` is no name of an image in left/ and right/");
    names[k] = name;
  }
  return names;
}

/// Whether the stamps of a times.txt are seconds. One with a point or an exponent says it of all:
/// programs print 1403636584 where the next is 1403636584.1.
bool in_seconds(const std::string& text) {
  Lines lines(text);
  for (std::string_view line; lines.next(&line);)
    if (line.substr(0, line.find(',')).find_first_of(".eE") != std::string_view::npos) return true;
  return false;
}

std::vector<Line> read_times(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  const bool seconds = in_seconds(text);
  Lines lines(text);
  std::vector<Line> times;
  for (std::string_view line; lines.next(&line);) {
    std::array<std::string_view, 3> fields;
    const std::size_t count = split(line, ',', fields);
    if (count > fields.size())
      refuse(file, lines.number(),
             "has " + std::to_string(count) + " columns; stamp[,file[,right file]] is expected");
    const auto ns = seconds ? parse_seconds_ns(fields[0]) : parse_integer(fields[0]);
    if (!ns)
      refuse(file, lines.number(),
             "`" + std::string(fields[0].substr(0, 40)) +
                 "` is neither integer nanoseconds nor seconds with a point" +
                 (lines.number() == 1 && count > 1 ? "; begin a line of headings with #" : ""));
    Line entry{Stamp(*ns), {}};
    if (count > 1) entry.name = names_of(file, lines.number(), std::span(fields).first(count));
    if (!times.empty() && times.front().name[0].empty() != entry.name[0].empty())
      refuse(file, lines.number(),
             "names an image where other lines do not, or the other way round; every line is of "
             "the same kind");
    times.push_back(std::move(entry));
  }
  if (times.empty()) refuse(file, 0, "holds no times; one line a pair is expected");
  return times;
}

/// Where nobody wrote down when: motion is predicted by frames, so a rate that is wrong spoils no
/// pose, but every stamp.
void assume_times(StereoSequence* sequence) {
  constexpr std::int64_t kStep = 100'000'000;  // ns
  for (std::size_t i = 0; i < sequence->pairs.size(); ++i)
    sequence->pairs[i].stamp = Stamp(static_cast<std::int64_t>(i) * kStep);
  sequence->remarks.emplace_back(
      "there is no times.txt: pairs are taken to be 0.1 s apart; write one line a pair, seconds "
      "with a point or whole nanoseconds");
}

std::string stem(const std::string& name) { return std::filesystem::path(name).stem().string(); }

/// Both lists sorted; equal stems meet, the others stand alone. A side that has no image gets the
/// name it should have had.
std::vector<StereoPair> pair_by_name(const std::vector<std::string>& left,
                                     const std::vector<std::string>& right) {
  std::vector<StereoPair> pairs;
  std::size_t l = 0, r = 0;
  while (l < left.size() || r < right.size()) {
    const bool have_left =
        l < left.size() && (r == right.size() || !in_name_order(stem(right[r]), stem(left[l])));
    const bool have_right =
        r < right.size() && (l == left.size() || !in_name_order(stem(left[l]), stem(right[r])));
    StereoPair pair;
    pair.file[0] =
        have_left ? left[l] : "left/" + std::filesystem::path(right[r]).filename().string();
    pair.file[1] =
        have_right ? right[r] : "right/" + std::filesystem::path(left[l]).filename().string();
    l += have_left ? 1 : 0;
    r += have_right ? 1 : 0;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

std::vector<StereoPair> pair_in_order(const std::vector<std::string>& left,
                                      const std::vector<std::string>& right) {
  std::vector<StereoPair> pairs(left.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].file = {left[i], right[i]};
  return pairs;
}

std::array<std::string, 2> in_folders(const std::array<std::string, 2>& names, bool side_by_side) {
  if (side_by_side) return {"both/" + names[0], "both/" + names[0]};
  return {"left/" + names[0], "right/" + names[1]};
}

/// Images as times.txt names them; some may be missing, but not all of a side.
std::vector<StereoPair> pair_as_named(const std::filesystem::path& folder,
                                      const std::vector<Line>& times,
                                      const std::array<std::vector<std::string>, 2>& there,
                                      bool side_by_side) {
  std::vector<StereoPair> pairs(times.size());
  for (std::size_t i = 0; i < times.size(); ++i)
    pairs[i] = {times[i].stamp, in_folders(times[i].name, side_by_side)};
  for (std::size_t k = 0; k < 2; ++k)
    if (std::none_of(times.begin(), times.end(), [&](const Line& line) {
          return std::binary_search(there[k].begin(), there[k].end(),
                                    in_folders(line.name, side_by_side)[k], in_name_order);
        }))
      refuse(folder / "times.txt", 0,
             "names no image that is there: the first is " +
                 in_folders(times.front().name, side_by_side)[k] + ", the folder has " +
                 there[k].front());
  return pairs;
}

/// By equal names, where these give as many pairs as there are times: a name that only one side has
/// is an image that the other lost. Else in order of name, where there is one of each a pair.
std::vector<StereoPair> pair_with_times(const std::filesystem::path& folder,
                                        const std::vector<Line>& times,
                                        const std::vector<std::string>& left,
                                        const std::vector<std::string>& right) {
  std::vector<StereoPair> pairs = pair_by_name(left, right);
  if (pairs.size() != times.size() && left.size() == right.size())
    pairs = pair_in_order(left, right);
  if (pairs.size() != times.size())
    refuse(folder, 0,
           "has " + std::to_string(left.size()) + " images in left/, " +
               std::to_string(right.size()) + " in right/ and " + std::to_string(times.size()) +
               " lines in times.txt; one of each a pair is expected (a line may name its image: "
               "stamp,file)");
  for (std::size_t i = 0; i < times.size(); ++i) pairs[i].stamp = times[i].stamp;
  return pairs;
}

/// By equal names; in order where no name is on both sides.
std::vector<StereoPair> pair_without_times(const std::filesystem::path& folder,
                                           const std::vector<std::string>& left,
                                           const std::vector<std::string>& right) {
  std::vector<StereoPair> pairs = pair_by_name(left, right);
  if (pairs.size() < left.size() + right.size()) return pairs;
  if (left.size() != right.size())
    refuse(folder, 0,
           "has " + std::to_string(left.size()) + " images in left/ and " +
               std::to_string(right.size()) +
               " in right/, without a name that is in both; give the images of a pair one name, or "
               "write a times.txt whose lines name them: stamp,left file,right file");
  return pair_in_order(left, right);
}

/// What is said where images ask to be turned.
std::string orientation_remark(const std::filesystem::path& file) {
  std::vector<std::uint8_t> bytes;
  if (read_image_file(file, &bytes) != ImageFileStatus::ok) return "";
  const auto orientation = exif_orientation(bytes);
  if (!orientation || *orientation == 1) return "";
  return file.string() + " asks viewers to turn it (EXIF orientation " +
         std::to_string(*orientation) +
         "), which is ignored: pixels are taken as the camera wrote them, and so has to be its "
         "calibration";
}

}  // namespace

StereoSequence open_folder(const std::filesystem::path& folder, bool given,
                           const CalibrationUse& use) {
  StereoSequence sequence;
  sequence.root = folder;
  std::error_code ignored;
  sequence.side_by_side = !std::filesystem::exists(folder / "left", ignored) &&
                          std::filesystem::exists(folder / "both", ignored);
  const auto left = list_images(folder, sequence.side_by_side ? "both" : "left");
  const auto right = sequence.side_by_side ? left : list_images(folder, "right");
  sequence.times = folder / "times.txt";
  if (std::filesystem::exists(sequence.times)) {
    const std::vector<Line> times = read_times(sequence.times);
    sequence.pairs = times.front().name[0].empty()
                         ? pair_with_times(folder, times, left, right)
                         : pair_as_named(folder, times, {left, right}, sequence.side_by_side);
  } else {
    sequence.pairs = pair_without_times(folder, left, right);
    assume_times(&sequence);
  }
  if (left.size() != right.size())
    sequence.remarks.push_back(
        "left/ has " + std::to_string(left.size()) + " images and right/ has " +
        std::to_string(right.size()) +
        ": where one camera lost an image without leaving a gap in the names or in times.txt, all "
        "pairs after it are a frame off; check that the names of a pair belong together");
  if (std::string turned = orientation_remark(folder / left.front()); !turned.empty())
    sequence.remarks.push_back(std::move(turned));
  if (given) return sequence;
  sequence.calibration = read_calibration(folder / "calibration.yaml", use).rig;
  sequence.calibration_source = "calibration.yaml";
  return sequence;
}

}  // namespace vergence::app::detail
