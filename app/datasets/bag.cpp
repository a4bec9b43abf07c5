#include <algorithm>
#include <array>
#include <memory>

#include <fmt/format.h>

#include "app/datasets/detail/bag_images.hpp"
#include "app/datasets/detail/bag_ins.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

/// A camera's topics have its namespace in common; that of packed images ends with another word.
std::string camera_of(std::string_view topic) {
  if (topic.ends_with("/compressed")) topic.remove_suffix(std::string_view("/compressed").size());
  const std::size_t slash = topic.rfind('/');
  return std::string(topic.substr(0, slash == std::string_view::npos ? 0 : slash));
}

bool is_rectified(std::string_view topic) {
  return topic.find("image_rect") != std::string_view::npos;
}

std::string list_of_image_topics(const BagIndex& bag) {
  std::string list;
  std::size_t unreadable = 0;
  for (const auto& [name, topic] : bag.images) {
    const std::size_t other = topic.left_out.unreadable;
    list += fmt::format("{}{} ({} images{})", list.empty() ? "" : ", ", name, topic.images.size(),
                        other > 0 ? fmt::format(", {} that cannot be read", other) : "");
    unreadable += other;
  }
  if (unreadable > 0)
    list += "; encodings that can be read: mono8, mono16, rgb8, bgr8, bayer_*8, and PNG and JPEG";
  return list.empty() ? "none" : list;
}

std::string choose(const fs::path& path, const BagIndex& bag, const std::string& requested,
                   std::string_view side) {
  const std::string ask =
      fmt::format("choose with --{}-topic; topics of images: {}", side, list_of_image_topics(bag));
  if (!requested.empty()) {
    const auto found = bag.images.find(requested);
    if (found == bag.images.end() || found->second.images.empty())
      refuse(path, 0, fmt::format("has no image on {} that can be read; {}", requested, ask));
    return requested;
  }
  std::vector<std::string> named;
  for (const auto& [name, topic] : bag.images)
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

RosCamera camera_info(const fs::path& path, const BagIndex& bag, const std::string& topic) {
  const std::string name = camera_of(topic) + "/camera_info";
  const auto found = bag.infos.find(name);
  if (found == bag.infos.end())
    refuse(path, 0,
           fmt::format("has no CameraInfo on {}, where that of {} is expected; give a calibration "
                       "with --calibration",
                       name, topic));
  const RosCameraInfo& info = found->second;
  RosCamera camera = is_rectified(topic) ? rectified(info.camera) : info.camera;
  const std::string& fault = is_rectified(topic) ? info.fault_rectified : info.fault;
  if (!fault.empty())
    refuse(path, 0, fmt::format("{}: {}; give a calibration with --calibration", name, fault));
  return camera;
}

}  // namespace

StereoSequence open_bag(BagFormat format, const std::filesystem::path& path, bool given,
                        const BagTopics& topics) {
  return sequence_of(path, index_bag(format, path, open_bag_files(format, path)), given, topics);
}

StereoSequence sequence_of(const std::filesystem::path& path, BagIndex bag, bool given,
                           const BagTopics& topics) {
  auto ins = std::make_shared<const RecordedIns>(bag_ins(path, bag, topics));
  const std::array chosen{choose(path, bag, topics.left, "left"),
                          choose(path, bag, topics.right, "right")};
  if (chosen[0] == chosen[1])
    refuse(path, 0, "is to give the left and the right images from one topic, " + chosen[0]);
  StereoSequence sequence;
  sequence.root = path;
  sequence.times = path;
  sequence.remarks = std::move(bag.remarks);
  sequence.ins = std::move(ins);
  for (const std::string& name : chosen) {
    const LeftOut& out = bag.images[name].left_out;
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
  std::array images{std::move(bag.images[chosen[0]].images),
                    std::move(bag.images[chosen[1]].images)};
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
  const auto store = std::make_shared<const BagImages>(bag.format, std::move(bag.files), chosen,
                                                       std::move(images));
  for (const auto& [l, r] : pairs)
    sequence.pairs.push_back({stamps[l], {store->name(0, l), store->name(1, r)}});
  sequence.store = store;
  return sequence;
}

}  // namespace vergence::app::detail
