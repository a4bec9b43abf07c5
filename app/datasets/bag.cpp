#include <algorithm>
#include <cmath>

#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

/// Namespace that the topics of a camera share. Topics of compressed images end with another word.
std::string camera_namespace(std::string_view topic) {
  if (topic.ends_with("/compressed")) topic.remove_suffix(std::string_view("/compressed").size());
  const std::size_t slash = topic.rfind('/');
  return std::string(topic.substr(0, slash == std::string_view::npos ? 0 : slash));
}

/// Topic of the CameraInfo: next to the image topic, below it if that topic is the camera's name,
/// or where the RealSense viewer has it (`CAMERA/image/data`, `CAMERA/info/camera_info`).
std::string camera_info_topic(const BagIndex& bag, const std::string& topic) {
  const std::string space = camera_namespace(topic);
  for (const std::string& name : {topic, space, camera_namespace(space) + "/info"})
    if (bag.infos.contains(name + "/camera_info")) return name + "/camera_info";
  return space + "/camera_info";
}

bool is_rectified(std::string_view topic) {
  // RealSense's image_rect_raw has its own K and D, as raw images have.
  return topic.find("image_rect") != std::string_view::npos &&
         topic.find("image_rect_raw") == std::string_view::npos;
}

std::string list_of_image_topics(const BagIndex& bag) {
  std::string list;
  std::size_t unreadable = 0;
  for (const auto& [name, topic] : bag.images) {
    list +=
        fmt::format("{}{} ({} images{})", list.empty() ? "" : ", ", name, topic.messages.size(),
                    topic.unreadable > 0 ? fmt::format(", {} of the unsupported encoding \"{}\"",
                                                       topic.unreadable, topic.encoding)
                                         : "");
    unreadable += topic.unreadable;
  }
  if (unreadable > 0)
    list +=
        "; supported encodings: mono8, mono16, rgb8, bgr8, rgba8, bgra8, 8UC1, 8UC3, 16UC1, "
        "yuv422, yuv422_yuy2, uyvy, yuyv, nv12, nv21, bayer_*8, bayer_*16, and PNG and JPEG";
  if (list.empty() && !bag.others.empty())
    return fmt::format(
        "none, because messages must be serialised by ROS (CDR or ROS 1); topics with other "
        "encodings: {}",
        fmt::join(bag.others, ", "));
  return list.empty() ? "none" : list;
}

using Topics = std::array<std::string, 2>;

void require_topic(const fs::path& path, const BagIndex& bag, const std::string& requested,
                   std::string_view side) {
  if (requested.empty()) return;
  const auto found = bag.images.find(requested);
  if (found == bag.images.end() || found->second.messages.empty())
    refuse(path, 0, "has no readable image on {}; choose another with --{}-topic; image topics: {}",
           requested, side, list_of_image_topics(bag));
}

/// Ranks a pair of topics: a CameraInfo for both (or a supplied calibration) counts most, then
/// unrectified images, then uncompressed ones.
int merit(const BagIndex& bag, const Topics& topics, bool given) {
  int sum = 0;
  for (const std::string& topic : topics) {
    if (given || bag.infos.contains(camera_info_topic(bag, topic))) sum += 4;
    if (!is_rectified(topic)) sum += 2;
    if (!topic.ends_with("/compressed")) sum += 1;
  }
  return sum;
}

/// The pair that the user names, or the best one with the usual names.
Topics choose(const fs::path& path, const BagIndex& bag, const BagTopics& requested, bool given) {
  require_topic(path, bag, requested.left, "left");
  require_topic(path, bag, requested.right, "right");
  if (!requested.left.empty() && !requested.right.empty()) return {requested.left, requested.right};
  std::vector<std::string> names;
  for (const auto& [name, topic] : bag.images) {
    const bool of_a_camera = std::ranges::none_of(
        std::array{"depth", "disparity", "confidence"},
        [small = lower(name)](const char* word) { return small.find(word) != std::string::npos; });
    if (!topic.messages.empty() && of_a_camera) names.push_back(name);
  }
  std::vector<Topics> best;
  for (const Topics& pair : stereo_names(names)) {
    if ((!requested.left.empty() && pair[0] != requested.left) ||
        (!requested.right.empty() && pair[1] != requested.right))
      continue;
    const int better = best.empty() ? 0 : merit(bag, pair, given) - merit(bag, best.front(), given);
    if (better > 0) best.clear();
    if (better >= 0) best.push_back(pair);
  }
  if (best.size() == 1) return best.front();
  refuse(path, 0,
         "has {} pairs of image topics named like a left and a right camera (left/right, "
         "infra1/infra2, cam0/cam1, image_0/image_1 …); choose with --left-topic and "
         "--right-topic; image topics: {}",
         best.size(), list_of_image_topics(bag));
}

std::vector<Stamp> collect_stamps(const std::vector<BagImage>& images) {
  std::vector<Stamp> stamps;
  stamps.reserve(images.size());
  for (const BagImage& image : images) stamps.push_back(image.image.stamp);
  return stamps;
}

/// Recording times of the images; empty if the bag lacks some of them.
std::vector<Stamp> recorded(const std::vector<BagImage>& images) {
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
  std::vector<Stamp> log;
  for (const BagImage& image : images) {
    if (image.log_time <= 0 || image.log_time > kFarthest) return {};
    log.emplace_back(image.log_time);
  }
  return log;
}

/// Pairs images by the nearest stamps and adds remarks about their distance. If the stamps do not
/// determine the pairs, the recording times do.
std::vector<std::array<std::size_t, 2>> pair_images(
    const fs::path& path, const Topics& topics, const std::array<std::vector<BagImage>, 2>& images,
    StereoSequence* sequence) {
  // Shares of the interval. The one of recording times keeps clear of both neighbours.
  constexpr double kHalf = 0.5, kNear = 0.25;
  const std::array stamps{collect_stamps(images[0]), collect_stamps(images[1])},
      log{recorded(images[0]), recorded(images[1])};
  const Duration interval = usual_interval(stamps[0]);
  const Duration most = Duration::seconds(kMaxApart * interval.to_seconds());
  const auto near =
      pair_nearest(stamps[0], stamps[1], Duration::seconds(kHalf * interval.to_seconds()));
  const PairOffset offset = pair_offset(stamps[0], stamps[1], near);
  const bool ambiguous = near.empty() || std::max(offset.median, -offset.median) > most;
  auto pairs = ambiguous
                   ? pair_nearest(log[0], log[1], Duration::seconds(kNear * interval.to_seconds()))
                   : pair_nearest(stamps[0], stamps[1], most);
  if (ambiguous && 2 * pairs.size() < std::min(images[0].size(), images[1].size())) pairs.clear();
  if (pairs.empty() && !near.empty())
    refuse(path, 0,
           "{} is stamped {:.3g} ms {} than {} at an interval of {:.3g} ms: the association of "
           "images is ambiguous; correct the stamps of one topic",
           topics[1], 1e3 * std::abs(offset.median.to_seconds()),
           offset.median > Duration{} ? "later" : "earlier", topics[0],
           1e3 * interval.to_seconds());
  if (pairs.empty())
    refuse(path, 0,
           "has no pair: header.stamp of {} begins at {} ns, of {} at {} ns, and no two differ by "
           "less than {:.0f} % of the interval; check the clocks, or choose other topics",
           topics[0], stamps[0].front().ns(), topics[1], stamps[1].front().ns(), 100 * kMaxApart);
  const PairOffset kept = pair_offset(stamps[0], stamps[1], pairs);
  sequence->assumptions.push_back(fmt::format(
      "images are paired by the nearest {}; right ones are later by {}",
      ambiguous ? "recording time, because their stamps are ambiguous" : "stamp", describe(kept)));
  const std::size_t alone = images[0].size() + images[1].size() - 2 * pairs.size();
  sequence->left_out += alone;
  remark_pairs(topics[0], topics[1], kept, interval, alone, &sequence->remarks);
  // By how much later right images were recorded than their stamps and the left images imply.
  const Duration late = log[0].empty() || log[1].empty()
                            ? -kept.median
                            : pair_offset(log[0], log[1], pairs).median - kept.median;
  if (std::max(late, -late) > most && !ambiguous)
    sequence->remarks.push_back(fmt::format(
        "the images of a pair of {} and {} were recorded {:.3g} ms further apart than their "
        "stamps, almost one interval; check whether one camera is stamped a frame early or late",
        topics[0], topics[1], 1e3 * std::max(late, -late).to_seconds()));
  return pairs;
}

RosCamera camera_info(const fs::path& path, const BagIndex& bag, const std::string& topic,
                      StereoSequence* sequence) {
  const std::string name = camera_info_topic(bag, topic);
  const auto found = bag.infos.find(name);
  if (found == bag.infos.end())
    refuse(path, 0,
           "has no CameraInfo on {}, where that of {} is expected; pass a calibration with "
           "--calibration",
           name, topic);
  const RosCameraInfo& info = found->second;
  const std::string& fault = is_rectified(topic) ? info.fault_rectified : info.fault;
  if (!fault.empty()) refuse(path, 0, "{}: {}; pass a calibration with --calibration", name, fault);
  RosCamera camera = info.camera;
  const ImageSize size = bag.images.at(topic).messages.front().image.size;
  if (const std::string remark = apply_crop(info.crop, size, &camera); !remark.empty())
    sequence->assumptions.push_back(name + ": " + remark);
  return is_rectified(topic) ? rectified(camera) : camera;
}

/// Adds remarks about mosaics: JPEG mixes their colours, which no demosaicing restores.
void remark_mosaics(const BagIndex& bag, const std::string& topic, StereoSequence* sequence) {
  const ImageTopic& of_topic = bag.images.at(topic);
  const BagImage& image = of_topic.messages.front();
  if (image.image.layout == PixelLayout::encoded_bayer) {
    std::array<std::uint8_t, 2> first{};
    (void)bag.files[image.file].bytes->read(image.place.offset + image.image.offset, first);
    const bool jpeg = image.place.chunk == BagPlace::kNoChunk ? first[0] == 0xFF : true;
    sequence->assumptions.push_back(
        topic + " holds Bayer mosaics according to its format; they are converted to grey");
    if (jpeg)
      sequence->remarks.push_back(
          topic +
          ": Bayer mosaics were compressed as JPEG, which mixes their colours and makes poses less "
          "accurate; record PNG, or debayer before compressing");
  }
  if (of_topic.unstamped > 0)
    sequence->assumptions.push_back(
        fmt::format("{}: {} images have no stamp (0); their recording time is used", topic,
                    of_topic.unstamped));
}

// Maximum distance of two orientations that are interpolated.
constexpr Duration kMaxGap = Duration::milliseconds(100);

template <typename Topics>
std::vector<std::string> usable(const Topics& topics) {
  std::vector<std::string> names;
  for (const auto& [name, topic] : topics)
    if (!topic.messages.empty()) names.push_back(name);
  return names;
}

std::string joined(const std::vector<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

template <typename Reading>
void remark_left_out(const std::string& name, const BagTopic<Reading>& topic,
                     std::vector<std::string>* remarks) {
  if (topic.unreadable + topic.backwards == 0) return;
  remarks->push_back(fmt::format(
      "{}: skipped are {} messages without usable numbers and {} whose stamps do not increase",
      name, topic.unreadable, topic.backwards));
}

/// Interpolates the orientation at the fix's time. *next is the index of the first orientation that
/// is not before the previous fix, and is advanced to this one. Returns false if none is near.
bool attitude_at(const std::vector<RosAttitude>& attitudes, std::size_t* next, InsSample* s) {
  while (*next < attitudes.size() && attitudes[*next].stamp < s->stamp) ++*next;
  if (*next == attitudes.size()) return false;
  const RosAttitude& after = attitudes[*next];
  const bool exact = after.stamp == s->stamp;
  if (*next == 0 && !exact) return false;
  const RosAttitude& before = exact ? after : attitudes[*next - 1];
  const Duration gap = after.stamp - before.stamp;
  if (gap > kMaxGap) return false;
  const auto quaternion = [](const RosAttitude& a) {
    return Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(a.q_world_body.data()));
  };
  const double share = exact ? 1 : (s->stamp - before.stamp).to_seconds() / gap.to_seconds();
  const Eigen::Quaterniond q = quaternion(before).slerp(share, quaternion(after));
  s->q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
  s->attitude_valid = true;
  s->tilt_sigma = after.tilt_sigma;
  s->heading_sigma = after.heading_sigma;
  return true;
}

RecordedIns combine(const std::string& name, const std::vector<InsRecord>& fixes,
                    const std::string& imu, const std::vector<RosAttitude>& attitudes) {
  RecordedIns ins;
  ins.readings.reserve(fixes.size());
  std::size_t next = 0, without = 0;
  for (const InsRecord& fix : fixes) {
    InsRecord& r = ins.readings.emplace_back(fix);
    r.sample.number = ins.readings.size() - 1;
    if (!attitude_at(attitudes, &next, &r.sample)) ++without;
  }
  ins.remarks.push_back(fmt::format("the INS is {} with the orientation of {}", name, imu));
  const auto no_fix = std::ranges::count_if(ins.readings, [](const InsRecord& r) {
    return r.sample.fix != FixStatus::fix_2d && r.sample.fix != FixStatus::fix_3d;
  });
  if (no_fix > 0)
    ins.remarks.push_back(
        fmt::format("{}: {} of {} samples have no fix: poses are not compared there", name, no_fix,
                    ins.readings.size()));
  if (without > 0)
    ins.remarks.push_back(fmt::format(
        "{}: {} fixes have no orientation of {} within {} ms: poses are not compared there", name,
        without, imu, kMaxGap.ns() / 1'000'000));
  return ins;
}

void require(const std::filesystem::path& path, const BagIndex& bag, const std::string& option,
             const std::string& requested, const std::vector<std::string>& there) {
  if (requested.empty() || std::ranges::find(there, requested) != there.end()) return;
  refuse(
      path, 0,
      "has no usable sample on {} for {}; NavSatFix topics: {}; Imu topics with an orientation: {}",
      requested, option, joined(usable(bag.fixes)), joined(usable(bag.attitudes)));
}

/// INS of a bag: NavSatFix with the orientation of Imu (docs/datasets.md). Empty with a remark if
/// there is none, it has no attitude, or several topics match. Throws InputError if topics.ins or
/// topics.imu has other messages.
RecordedIns bag_ins(const std::filesystem::path& path, const BagIndex& bag,
                    const BagTopics& topics) {
  const std::vector<std::string> fixes = usable(bag.fixes), imus = usable(bag.attitudes);
  require(path, bag, "--ins-topic", topics.ins, fixes);
  require(path, bag, "--imu-topic", topics.imu, imus);
  const auto chosen = [](const std::string& requested, const std::vector<std::string>& there) {
    return requested.empty() && there.size() == 1 ? there.front() : requested;
  };
  const std::string fix = chosen(topics.ins, fixes), imu = chosen(topics.imu, imus);
  RecordedIns ins;
  if (fix.empty() && fixes.empty()) return ins;
  if (!fix.empty() && !imu.empty()) {
    ins = combine(fix, bag.fixes.at(fix).messages, imu, bag.attitudes.at(imu).messages);
    remark_left_out(imu, bag.attitudes.at(imu), &ins.remarks);
  } else if (!fix.empty() && imus.empty()) {
    ins.remarks.push_back("the NavSatFix of " + fix +
                          " has no matching Imu orientation: poses are not compared");
  } else {
    ins.remarks.push_back(fmt::format(
        "several topics could be the INS, so poses are not compared; choose with --ins-topic and "
        "--imu-topic; NavSatFix topics: {}; Imu topics with an orientation: {}",
        joined(fixes), joined(imus)));
  }
  if (!fix.empty()) remark_left_out(fix, bag.fixes.at(fix), &ins.remarks);
  return ins;
}

}  // namespace

StereoSequence open_bag(BagFormat format, const std::filesystem::path& path, bool given,
                        const BagTopics& topics) {
  return make_sequence(path, index_bag(format, path, open_bag_files(format, path)), given, topics);
}

StereoSequence make_sequence(const std::filesystem::path& path, BagIndex bag, bool given,
                             const BagTopics& topics) {
  auto ins = std::make_shared<const RecordedIns>(bag_ins(path, bag, topics));
  const Topics chosen = choose(path, bag, topics, given);
  if (chosen[0] == chosen[1])
    refuse(path, 0,
           "has one topic selected for left and right images; choose two with --left-topic and "
           "--right-topic: {}",
           chosen[0]);
  StereoSequence sequence{
      .root = path, .times = path, .remarks = std::move(bag.remarks), .ins = std::move(ins)};
  for (const std::string& name : chosen) {
    const ImageTopic& topic = bag.images[name];
    const std::size_t omitted = topic.unreadable + topic.other_size + topic.backwards;
    if (omitted > 0)
      sequence.remarks.push_back(fmt::format(
          "{}: skipped are {} unreadable images, {} of another size than the first and {} whose "
          "stamps do not increase{}",
          name, topic.unreadable, topic.other_size, topic.backwards,
          topic.first_omitted.empty() ? "" : "; the first in " + topic.first_omitted));
    sequence.left_out += omitted;
  }
  if (topics.left.empty() || topics.right.empty())
    if (bag.images.size() > 2 || chosen[0].find("left") == std::string::npos)
      sequence.assumptions.push_back(chosen[0] + " is left and " + chosen[1] + " is right");
  for (const std::string& name : chosen) remark_mosaics(bag, name, &sequence);
  if (!given && camera_info_topic(bag, chosen[0]) == camera_info_topic(bag, chosen[1]))
    refuse(
        path, 0,
        "has no separate CameraInfo for {} and {}, only {}; pass a calibration with --calibration",
        chosen[0], chosen[1], camera_info_topic(bag, chosen[0]));
  if (!given) {
    const std::array cameras{camera_info(path, bag, chosen[0], &sequence),
                             camera_info(path, bag, chosen[1], &sequence)};
    if (const std::string fault = set_ros_rig(cameras[0], cameras[1], &sequence.calibration);
        !fault.empty())
      refuse(path, 0, "{}/camera_info: P {}; pass a calibration with --calibration",
             camera_namespace(chosen[1]), fault);
    sequence.calibration_source =
        "CameraInfo of " + camera_namespace(chosen[0]) + " and " + camera_namespace(chosen[1]);
  }
  std::array images{std::move(bag.images[chosen[0]].messages),
                    std::move(bag.images[chosen[1]].messages)};
  for (std::size_t k = 0; k < 2; ++k)
    if (images[k].back().image.stamp.ns() == 0)
      refuse(path, 0,
             "{} has neither stamps (header.stamp is 0) nor recording times; record it again with "
             "stamps",
             chosen[k]);
  const auto pairs = pair_images(path, chosen, images, &sequence);
  const std::vector<Stamp> stamps = collect_stamps(images[0]);
  const auto store = std::make_shared<const BagImages>(bag.format, std::move(bag.files), chosen,
                                                       std::move(images));
  for (const auto& [l, r] : pairs)
    sequence.pairs.push_back({stamps[l], {store->name(0, l), store->name(1, r)}});
  sequence.store = store;
  return sequence;
}

}  // namespace vergence::app::detail
