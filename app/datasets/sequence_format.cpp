#include "app/datasets/sequence_format.hpp"

#include <system_error>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {

SequenceFormat sequence_format(const std::string& word, const std::filesystem::path& folder) {
  constexpr const char* kLayouts =
      "KITTI (image_0, image_1, calib.txt, times.txt), KITTI raw (image_00, image_01, calib_*.txt "
      "above), EuRoC (mav0), plain (left, "
      "right, times.txt, calibration.yaml), UQ St Lucia and bags of ROS 2 (.mcap) and ROS 1 (.bag) "
      "are what can be read";
  if (word == "kitti") return SequenceFormat::kitti;
  if (word == "kitti-raw") return SequenceFormat::kitti_raw;
  if (word == "euroc") return SequenceFormat::euroc;
  if (word == "folder") return SequenceFormat::folder;
  if (word == "st-lucia") return SequenceFormat::st_lucia;
  if (word == "mcap") return SequenceFormat::mcap;
  if (word == "rosbag") return SequenceFormat::rosbag;
  if (word == "session")
    throw InputError(
        "--format session is not there yet in this version; kitti, kitti-raw, euroc, folder, "
        "st-lucia, mcap and rosbag are");
  if (word != "auto")
    throw InputError("--format \"" + word + "\" is not known" +
                     did_you_mean(word, {"auto", "kitti", "kitti-raw", "euroc", "folder",
                                         "st-lucia", "mcap", "rosbag", "session"}) +
                     "; kitti, kitti-raw, euroc, folder, st-lucia, mcap and rosbag are what can be "
                     "read, and auto finds out which it is");
  std::error_code ignored;
  if (const auto bag = bag_format(folder); bag && !std::filesystem::is_directory(folder, ignored))
    return *bag;
  if (!std::filesystem::is_directory(folder, ignored))
    throw InputError(folder.string() + ": is no folder; a folder with a drive is expected");
  if (const auto found = find_format(folder)) return *found;
  throw InputError(folder.string() + ": holds no drive that is known: " + kLayouts);
}

void check_topics(SequenceFormat format, const BagTopics& topics) {
  if (!is_bag(format) && !topics.empty())
    throw InputError(
        "topics are chosen of bags (--format mcap or rosbag); leave --left-topic, --right-topic, "
        "--ins-topic and --imu-topic away");
}

}  // namespace vergence::app
