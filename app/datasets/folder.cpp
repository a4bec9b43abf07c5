#include <algorithm>

#include "app/config/calibration_file.hpp"
#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

std::vector<Stamp> read_times(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  Lines lines(text);
  std::vector<Stamp> times;
  for (std::string_view line; lines.next(&line);) {
    const auto ns = line.find('.') != std::string_view::npos ? parse_seconds_ns(line) : parse_integer(line);
    if (!ns)
      refuse(file, lines.number(), "`" + std::string(line.substr(0, 40)) + "` is neither integer nanoseconds nor seconds with a point");
    times.emplace_back(*ns);
  }
  return times;
}

std::string stem(const std::string& name) { return std::filesystem::path(name).stem().string(); }

/// Both lists sorted; equal stems meet, the others stand alone. A side that has no image gets the name it should have had.
std::vector<StereoPair> pair_by_name(const std::vector<std::string>& left, const std::vector<std::string>& right) {
  std::vector<StereoPair> pairs;
  std::size_t l = 0, r = 0;
  while (l < left.size() || r < right.size()) {
    const bool have_left = l < left.size() && (r == right.size() || stem(left[l]) <= stem(right[r]));
    const bool have_right = r < right.size() && (l == left.size() || stem(right[r]) <= stem(left[l]));
    StereoPair pair;
    pair.file[0] = have_left ? left[l] : "left/" + std::filesystem::path(right[r]).filename().string();
    pair.file[1] = have_right ? right[r] : "right/" + std::filesystem::path(left[l]).filename().string();
    l += have_left ? 1 : 0;
    r += have_right ? 1 : 0;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

std::vector<StereoPair> pair_in_order(const std::vector<std::string>& left, const std::vector<std::string>& right) {
  std::vector<StereoPair> pairs(left.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].file = {left[i], right[i]};
  return pairs;
}

}  // namespace

StereoSequence open_folder(const std::filesystem::path& folder, bool given, const CalibrationUse& use) {
  StereoSequence sequence;
  sequence.root = folder;
  const auto left = list_images(folder, "left"), right = list_images(folder, "right");
  const auto times = read_times(folder / "times.txt");
  // In order of name as long as the numbers agree; else a name that only one side has is an image that the other lost.
  const bool in_order = left.size() == right.size() && left.size() == times.size();
  sequence.pairs = in_order ? pair_in_order(left, right) : pair_by_name(left, right);
  if (sequence.pairs.size() != times.size())
    refuse(folder, 0,
           "has " + std::to_string(left.size()) + " images in left/, " + std::to_string(right.size()) + " in right/ and " +
               std::to_string(times.size()) + " lines in times.txt; one of each a pair is expected");
  for (std::size_t i = 0; i < times.size(); ++i) sequence.pairs[i].stamp = times[i];
  if (given) return sequence;
  sequence.calibration = read_calibration(folder / "calibration.yaml", use).rig;
  sequence.calibration_source = "calibration.yaml";
  return sequence;
}

}  // namespace vergence::app::detail
