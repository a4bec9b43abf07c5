#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "app/datasets/detail/bag_images.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/jpeg.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 500;  // each stays open
constexpr std::size_t kMostImages =
    4'000'000;  // of all topics: a day and a half at 30 Hz, 320 MB of index
constexpr std::size_t kMostInfo = 65536;  // bytes of a CameraInfo

/// What is left out of a topic, and where that begins.
struct LeftOut {
  std::size_t unreadable = 0, other_size = 0, backwards = 0;
  std::string first{};  // file and offset
};

struct Topic {
  std::vector<BagImage> images{};
  std::optional<RosCameraInfo> info{};
  LeftOut left_out{};
  bool of_images = false;
};

struct Bag {
  std::vector<std::unique_ptr<FileBytes>> files{};
  std::map<std::string, Topic> topics{};
  std::vector<std::string> remarks{};
  std::size_t images = 0;
};

std::vector<fs::path> files_of(const fs::path& bag) {
  std::error_code error;
  if (!fs::is_directory(bag, error)) {
    if (!fs::exists(bag, error))
      refuse(bag, 0, "does not exist; a .mcap file or a folder with some is expected");
    return {bag};
  }
  std::vector<fs::path> files;
  for (fs::directory_iterator it(bag, error), end; !error && it != end; it.increment(error))
    if (it->path().extension() == ".mcap") files.push_back(it->path());
  if (error) refuse(bag, 0, "cannot be listed (" + error.message() + "): check its permissions");
  if (files.empty()) refuse(bag, 0, "holds no .mcap file");
  if (files.size() > kMostFiles)
    refuse(bag, 0,
           fmt::format("holds {} .mcap files; at most {} are read", files.size(), kMostFiles));
  // rosbag2 counts them without leading zeros: drive_2.mcap stands before drive_10.mcap.
  const auto order = [](const fs::path& a, const fs::path& b) {
    const std::string l = a.filename().string(), r = b.filename().string();
    return l.size() != r.size() ? l.size() < r.size() : l < r;
  };
  std::sort(files.begin(), files.end(), order);
  return files;
}

std::vector<std::uint8_t> first_bytes(const McapMessage& message, std::size_t most) {
  std::vector<std::uint8_t> bytes(std::min<std::size_t>(most, message.place.size));
  if (!message.bytes->read(message.place.offset, bytes)) bytes.clear();
  return bytes;
}

/// A camera's topics have its namespace in common; that of packed images ends with another word.
std::string camera_of(std::string_view topic) {
  if (topic.ends_with("/compressed")) topic.remove_suffix(std::string_view("/compressed").size());
  const std::size_t slash = topic.rfind('/');
  return std::string(topic.substr(0, slash == std::string_view::npos ? 0 : slash));
}

bool is_rectified(std::string_view topic) {
  return topic.find("image_rect") != std::string_view::npos;
}

void take_image(const fs::path& path, const McapMessage& message, std::uint32_t file,
                bool compressed, Bag* bag) {
  Topic& topic = bag->topics[message.channel->topic];
  topic.of_images = true;
  const std::vector<std::uint8_t> head =
      first_bytes(message, compressed ? kJpegHead : kRosImageHead);
  const auto image = compressed ? read_ros_compressed_image(head, message.place.size)
                                : read_ros_image(head, message.place.size);
  LeftOut& out = topic.left_out;
  const bool backwards =
      image && !topic.images.empty() && image->stamp <= topic.images.back().image.stamp;
  const bool other_size =
      image && !topic.images.empty() && image->size != topic.images.front().image.size;
  if (image && !backwards && !other_size) {
    if (++bag->images > kMostImages)
      refuse(path, 0, fmt::format("brings more than {} images; cut the bag", kMostImages));
    topic.images.push_back({*image, message.place, file});
    return;
  }
  if (out.first.empty())
    out.first = fmt::format(
        "{}, offset {}{}", path.filename().string(),
        message.place.chunk == McapPlace::kNoChunk ? message.place.offset : message.place.chunk,
        message.place.chunk == McapPlace::kNoChunk ? "" : " (of its chunk)");
  ++(!image ? out.unreadable : backwards ? out.backwards : out.other_size);
}

void take_message(const fs::path& path, const McapMessage& message, std::uint32_t file, Bag* bag) {
  if (message.channel->encoding != "cdr") return;
  const std::string& type = message.channel->type;
  const bool compressed = type == "sensor_msgs/msg/CompressedImage";
  if (compressed || type == "sensor_msgs/msg/Image")
    return take_image(path, message, file, compressed, bag);
  if (type != "sensor_msgs/msg/CameraInfo") return;
  Topic& topic = bag->topics[message.channel->topic];
  if (!topic.info) topic.info = read_ros_camera_info(first_bytes(message, kMostInfo));
}

Bag read_bag(const fs::path& path) {
  Bag bag;
  for (const fs::path& file : files_of(path)) {
    bag.files.push_back(std::make_unique<FileBytes>(file));
    const auto index = static_cast<std::uint32_t>(bag.files.size() - 1);
    const McapScan scan = scan_mcap(
        *bag.files.back(), [&](const McapMessage& m) { take_message(file, m, index, &bag); });
    const std::string name = file.filename().string();
    if (!scan.finished)
      bag.remarks.push_back(fmt::format(
          "{} is unfinished: it was read up to offset {}, where its last whole record ends", name,
          scan.end));
    if (scan.first_broken)
      bag.remarks.push_back(fmt::format(
          "{}: {} chunks and {} records were left out; the first at offset {} is {}", name,
          scan.broken_chunks, scan.broken_records, *scan.first_broken, scan.why_broken));
    if (scan.orphans > 0)
      bag.remarks.push_back(
          fmt::format("{}: {} messages of no described channel were left out", name, scan.orphans));
  }
  return bag;
}

std::string list_of_image_topics(const Bag& bag) {
  std::string list;
  for (const auto& [name, topic] : bag.topics)
    if (topic.of_images)
      list += fmt::format("{}{} ({} images)", list.empty() ? "" : ", ", name, topic.images.size());
  return list.empty() ? "none" : list;
}

std::string choose(const fs::path& path, const Bag& bag, const std::string& requested,
                   std::string_view side) {
  const std::string ask =
      fmt::format("choose with --{}-topic; topics of images: {}", side, list_of_image_topics(bag));
  if (!requested.empty()) {
    const auto found = bag.topics.find(requested);
    if (found == bag.topics.end() || found->second.images.empty())
      refuse(path, 0, fmt::format("has no image on {} that can be read; {}", requested, ask));
    return requested;
  }
  std::vector<std::string> named;
  for (const auto& [name, topic] : bag.topics)
    if (!topic.images.empty() && name.find(side) != std::string::npos) named.push_back(name);
  if (named.size() != 1)
    refuse(path, 0,
           fmt::format("has {} topics of images with \"{}\" in their names; {}", named.size(), side,
                       ask));
  return named.front();
}

Duration half_interval(const std::vector<BagImage>& images) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < images.size(); ++i)
    ns.push_back((images[i].image.stamp - images[i - 1].image.stamp).ns());
  if (ns.empty()) return Duration::nanoseconds(50'000'000);
  const auto middle = ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2);
  std::nth_element(ns.begin(), middle, ns.end());
  return Duration::nanoseconds(*middle / 2);
}

std::int64_t apart(const BagImage& a, const BagImage& b) {
  const std::int64_t ns = (a.image.stamp - b.image.stamp).ns();
  return ns < 0 ? -ns : ns;
}

/// Indices of images that are each other's nearest, within `most`; both lists ascend.
std::vector<std::array<std::size_t, 2>> pair_nearest(const std::vector<BagImage>& left,
                                                     const std::vector<BagImage>& right,
                                                     Duration most) {
  const auto nearest = [](const std::vector<BagImage>& in, const BagImage& to, std::size_t from) {
    while (from + 1 < in.size() && apart(in[from + 1], to) < apart(in[from], to)) ++from;
    return from;
  };
  std::vector<std::array<std::size_t, 2>> pairs;
  for (std::size_t l = 0, r = 0, back = 0; l < left.size(); ++l) {
    r = nearest(right, left[l], r);
    back = nearest(left, right[r], back);
    if (back == l && apart(left[l], right[r]) <= most.ns()) pairs.push_back({l, r});
  }
  return pairs;
}

void remark_left_out(const std::string& name, const LeftOut& out,
                     std::vector<std::string>* remarks) {
  if (out.first.empty()) return;
  remarks->push_back(
      fmt::format("{}: left out were {} images that cannot be read, {} of another size than the "
                  "first and {} whose stamps do not go "
                  "forward; the first in {}",
                  name, out.unreadable, out.other_size, out.backwards, out.first));
}

RosCamera camera_info(const fs::path& path, const Bag& bag, const std::string& topic) {
  const std::string name = camera_of(topic) + "/camera_info";
  const auto found = bag.topics.find(name);
  if (found == bag.topics.end() || !found->second.info)
    refuse(path, 0,
           fmt::format("has no CameraInfo on {}, where that of {} is expected; give a calibration "
                       "with --calibration",
                       name, topic));
  const RosCameraInfo& info = *found->second.info;
  const RosCamera camera = is_rectified(topic) ? rectified(info.camera) : info.camera;
  const std::string& fault = is_rectified(topic) ? info.fault_rectified : info.fault;
  if (!fault.empty())
    refuse(path, 0, fmt::format("{}: {}; give a calibration with --calibration", name, fault));
  return camera;
}

}  // namespace

StereoSequence open_bag(const std::filesystem::path& path, bool given, const BagTopics& topics) {
  Bag bag = read_bag(path);
  const std::array chosen{choose(path, bag, topics.left, "left"),
                          choose(path, bag, topics.right, "right")};
  if (chosen[0] == chosen[1])
    refuse(path, 0, "is to give the left and the right images from one topic, " + chosen[0]);
  StereoSequence sequence;
  sequence.root = path;
  sequence.times = path;
  sequence.remarks = std::move(bag.remarks);
  for (const std::string& name : chosen) {
    const LeftOut& out = bag.topics[name].left_out;
    remark_left_out(name, out, &sequence.remarks);
    sequence.left_out += out.unreadable + out.other_size + out.backwards;
  }
  if (!given) {
    const std::array cameras{camera_info(path, bag, chosen[0]), camera_info(path, bag, chosen[1])};
    if (const std::string fault = set_ros_rig(cameras[0], cameras[1], &sequence.calibration);
        !fault.empty())
      refuse(path, 0,
             fmt::format("{}/camera_info: p {}; give a calibration with --calibration",
                         camera_of(chosen[1]), fault));
    sequence.calibration_source =
        "CameraInfo of " + camera_of(chosen[0]) + " and " + camera_of(chosen[1]);
  }
  std::array images{std::move(bag.topics[chosen[0]].images),
                    std::move(bag.topics[chosen[1]].images)};
  const auto pairs = pair_nearest(images[0], images[1], half_interval(images[0]));
  if (pairs.empty())
    refuse(path, 0,
           fmt::format("has no pair: header.stamp of {} begins at {} ns, of {} at {} ns, and no "
                       "two are within half a frame of each other",
                       chosen[0], images[0].front().image.stamp.ns(), chosen[1],
                       images[1].front().image.stamp.ns()));
  const std::size_t alone = images[0].size() + images[1].size() - 2 * pairs.size();
  if (alone > 0)
    sequence.remarks.push_back(
        fmt::format("{} images have no partner within half a frame and were left out", alone));
  sequence.left_out += alone;
  std::vector<Stamp> stamps;
  for (const BagImage& image : images[0]) stamps.push_back(image.image.stamp);
  const auto store =
      std::make_shared<const BagImages>(std::move(bag.files), chosen, std::move(images));
  for (const auto& [l, r] : pairs)
    sequence.pairs.push_back({stamps[l], {store->name(0, l), store->name(1, r)}});
  sequence.store = store;
  return sequence;
}

}  // namespace vergence::app::detail
