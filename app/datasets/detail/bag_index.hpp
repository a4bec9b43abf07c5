#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/datasets/detail/bag_scan.hpp"
#include "app/datasets/detail/ros_ins_messages.hpp"
#include "app/datasets/detail/ros_messages.hpp"

/// Content of a ROS recording by topic.
namespace vergence::app::detail {

/// Where an image of a bag is; its pixels stay in the file.
struct BagImage {
  RosImage image{};
  std::int64_t log_time = 0;  // ns, when it was recorded
  BagPlace place{};
  std::uint32_t file = 0;  // of the bag's files
};

/// Messages of a topic that are omitted, and the first position.
struct LeftOut {
  std::size_t unreadable = 0, other_size = 0, backwards = 0;
  std::string first{};     // file and offset
  std::string encoding{};  // of the first that cannot be read, as it names itself
};

/// Images of one size, stamps strictly ascending.
struct ImageTopic {
  std::vector<BagImage> images{};
  LeftOut left_out{};
  std::size_t unstamped = 0;  // whose stamp was 0: the time of recording has its place
};

/// Readings whose stamps strictly ascend.
template <typename Reading>
struct ReadingTopic {
  std::vector<Reading> readings{};
  std::size_t unreadable = 0;  // are no such message, or numbers of them are none
  std::size_t backwards = 0;   // left out: stamps go back or repeat one
};

/// A file of a bag.
struct BagFile {
  std::string name{};
  std::unique_ptr<const ByteSource> bytes{};
};

struct BagIndex {
  BagFormat format{};
  std::vector<BagFile> files{};
  std::map<std::string, ImageTopic> images{};  // by topic, all of these
  std::map<std::string, RosCameraInfo> infos{};
  std::map<std::string, ReadingTopic<RosFix>> fixes{};
  std::map<std::string, ReadingTopic<RosAttitude>> attitudes{};  // without orientation: unreadable
  std::vector<std::string> others{};   // some topics that are not read, each with its type
  std::vector<std::string> remarks{};  // a message each
};

/// The files of a bag: one, or those of a folder in the order in which recorders count them.
/// InputError: no such file, no file of the format in the folder.
[[nodiscard]] std::vector<BagFile> open_bag_files(BagFormat format,
                                                  const std::filesystem::path& path);

/// All messages of a bag's files. `path`: for messages.
/// Memory  80 bytes an image, 60 to 180 a reading of an INS.
/// InputError  A file does not begin as the format does, there are more images or readings than are
/// held.
[[nodiscard]] BagIndex index_bag(BagFormat format, const std::filesystem::path& path,
                                 std::vector<BagFile> files);

}  // namespace vergence::app::detail
