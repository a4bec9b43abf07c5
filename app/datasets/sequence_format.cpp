#include "app/datasets/sequence_format.hpp"

#include <algorithm>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {

SequenceFormat sequence_format(const std::string& word, const std::filesystem::path& folder) {
  constexpr const char* kLayouts =
      "KITTI (image_0, image_1, calib.txt, times.txt), KITTI raw (image_00, image_01, calib_*.txt "
      "above), EuRoC (mav0), plain (left, right or other usual names, times.txt, "
      "calibration.yaml), UQ St Lucia, bags of ROS 2 (.mcap, .db3) and ROS 1 (.bag) and sessions "
      "with a recording (drive.mcap) are what can be read";
  const std::vector<std::string> words{"kitti", "kitti-raw", "euroc", "folder", "st-lucia",
                                       "mcap",  "rosbag",    "db3",   "session"};
  if (const auto at = std::find(words.begin(), words.end(), word); at != words.end())
    return static_cast<SequenceFormat>(at - words.begin());
  if (word != "auto")
    throw InputError(fmt::format("--format \"{}\": unknown format{}; use auto or one of {}", word,
                                 did_you_mean(word, words), fmt::join(words, ", ")));
  std::error_code ignored;
  if (const auto bag = bag_format(folder); bag && !std::filesystem::is_directory(folder, ignored))
    return *bag;
  if (!std::filesystem::is_directory(folder, ignored))
    if (const std::string advice = unpack_advice(folder); !advice.empty())
      throw InputError(folder.string() + ": " + advice);
  if (!std::filesystem::is_directory(folder, ignored))
    throw InputError(
        folder.string() +
        ": no such directory; pass a data-set directory, or a .mcap, .db3 or .bag file");
  if (const auto found = find_format(folder)) return *found;
  for (std::filesystem::directory_iterator it(folder, ignored), end; !ignored && it != end;
       it.increment(ignored))
    if (const std::string advice = unpack_advice(it->path()); !advice.empty())
      throw InputError(it->path().string() + ": " + advice);
  throw InputError(folder.string() + ": no known data-set format; expected: " + kLayouts);
}

void check_topics(SequenceFormat format, const BagTopics& topics) {
  if (!is_bag(format) && !topics.empty())
    throw InputError(
        "--left-topic, --right-topic, --ins-topic and --imu-topic are for bags (--format mcap, db3 "
        "or rosbag); remove them");
}

}  // namespace vergence::app
