#include "app/datasets/sequence_format.hpp"

#include <algorithm>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {

SequenceFormat sequence_format(const std::string& word, const std::filesystem::path& folder) {
  constexpr const char* kLayouts =
      "KITTI (image_0, image_1, calib.txt, times.txt), KITTI raw (image_00, image_01, calib_*.txt "
      "in the parent directory), EuRoC (mav0), a folder with left/ and right/ (or other usual "
      "names), times.txt and calibration.yaml, UQ St Lucia, bags of ROS 2 (.mcap, .db3) and ROS 1 "
      "(.bag), sessions with a recording (drive.mcap)";
  const std::vector<std::string> words{"kitti", "kitti-raw", "euroc", "folder", "st-lucia",
                                       "mcap",  "rosbag",    "db3",   "session"};
  if (const auto at = std::ranges::find(words, word); at != words.end())
    return static_cast<SequenceFormat>(at - words.begin());
  if (word != "auto")
    throw InputError(fmt::format("--format \"{}\": unknown format; use auto, {}{}", word,
                                 fmt::join(words, ", "), did_you_mean(word, words)));
  std::error_code ignored;
  if (const auto bag = bag_format(folder); bag && !std::filesystem::is_directory(folder, ignored))
    return *bag;
  if (!std::filesystem::is_directory(folder, ignored))
    if (const std::string advice = unpack_advice(folder); !advice.empty())
      refuse(folder, 0, advice);
  if (!std::filesystem::is_directory(folder, ignored))
    refuse(folder, 0, "{}; pass a data-set directory, or a .mcap, .db3 or .bag file",
           std::filesystem::exists(folder, ignored) ? "is a file that is not a bag"
                                                    : "no such directory");
  if (const auto found = find_format(folder)) return *found;
  for (std::filesystem::directory_iterator it(folder, ignored), end; !ignored && it != end;
       it.increment(ignored))
    if (const std::string advice = unpack_advice(it->path()); !advice.empty())
      refuse(it->path(), 0, advice);
  refuse(folder, 0, "not a known data-set format; expected is one of: {}", kLayouts);
}

void check_topics(SequenceFormat format, const BagTopics& topics) {
  if (!is_bag(format) && !topics.empty())
    throw InputError(
        "--left-topic, --right-topic, --ins-topic and --imu-topic select topics of a bag, and DATA "
        "is not a bag; remove them");
}

}  // namespace vergence::app
