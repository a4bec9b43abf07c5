#include "app/datasets/detail/bag_index.hpp"

#include <cstdlib>
#include <system_error>

#include "app/datasets/detail/image_kinds.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/text_file.hpp"
#include "core/math/robust.hpp"
#include "core/types/bayer.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

// Images and samples of all topics: a day and a half at 30 Hz, some 300 MB of index.
constexpr std::size_t kMaxMessages = 8'000'000;
// Size of a CameraInfo and of an INS sample.
constexpr std::size_t kMaxBytes = 65536;

struct Container {
  BagFormat format;
  SequenceFormat sequence;
  const char* ending;
  const char* beginning;
};
constexpr std::array kContainers{
    Container{BagFormat::mcap, SequenceFormat::mcap, ".mcap",
              "an MCAP file (offset 0: 89 4D 43 41 50 30 0D 0A)"},
    Container{BagFormat::rosbag, SequenceFormat::rosbag, ".bag",
              "a ROS 1 bag of version 2.0 (offset 0: #ROSBAG V2.0)"},
    Container{BagFormat::sqlite, SequenceFormat::db3, ".db3",
              "a complete SQLite file of rosbag2, with the tables topics and messages"}};

const Container& find_container(BagFormat format) {
  return kContainers[static_cast<std::size_t>(format)];
}

std::vector<fs::path> list_files(BagFormat format, const fs::path& bag) {
  const Container& container = find_container(format);
  std::error_code error;
  if (!fs::is_directory(bag, error)) {
    if (!fs::exists(bag, error))
      refuse(bag, 0, "does not exist; a {} file or a directory with such files is expected",
             container.ending);
    return {bag};
  }
  // Recorders count without leading zeros: drive_2.mcap precedes drive_10.mcap.
  std::vector<fs::path> files = entries_in(bag, &error);
  if (error) refuse(bag, 0, "cannot be listed ({}); check its permissions", error.message());
  std::erase_if(files, [&](const auto& file) { return bag_format(file) != container.sequence; });
  if (files.empty()) refuse(bag, 0, "holds no {} file", container.ending);
  return files;
}

class Indexer {
 public:
  Indexer(BagFormat format, const fs::path& path, std::vector<BagFile> files) : path_(path) {
    bag_.format = format;
    bag_.files = std::move(files);
    for (; file_ < bag_.files.size(); ++file_) scan();
    for (auto& [name, topic] : bag_.images) {
      replace_zero_stamps(&topic);
      put_in_order(&topic, [](const BagImage& m) { return m.image.stamp; });
    }
    for (auto& [name, topic] : bag_.fixes)
      put_in_order(&topic, [](const InsRecord& m) { return m.sample.stamp; });
    for (auto& [name, topic] : bag_.attitudes)
      put_in_order(&topic, [](const RosAttitude& m) { return m.stamp; });
  }
  BagIndex release_index() { return std::move(bag_); }

 private:
  void scan() {
    const BagFile& file = bag_.files[file_];
    const auto scan =
        scan_bag(bag_.format, *file.bytes, [this](const BagMessage& m) { read_message(m); });
    if (!scan) refuse(path_, 0, "{} is not {}", file.name, find_container(bag_.format).beginning);
    scan->remark(file.name, &bag_.remarks);
  }

  void read_message(const BagMessage& message) {
    if (message.channel->encoding == MessageEncoding::other) return read_other(message);
    const std::string &type = message.channel->type, &topic = message.channel->topic;
    if (type == "sensor_msgs/Image") return read_image(message, false);
    if (type == "sensor_msgs/CompressedImage") return read_image(message, true);
    if (type == "sensor_msgs/CameraInfo") return read_info(message);
    if (type == "sensor_msgs/NavSatFix") return read_ins(message, read_ros_fix, &bag_.fixes[topic]);
    if (type == "sensor_msgs/Imu")
      return read_ins(message, read_ros_attitude, &bag_.attitudes[topic]);
    read_other(message);
  }

  void read_other(const BagMessage& message) {
    constexpr std::size_t kMax = 8;
    std::string name = message.channel->topic + " of " + message.channel->type;
    if (bag_.others.size() < kMax && std::ranges::find(bag_.others, name) == bag_.others.end())
      bag_.others.push_back(std::move(name));
  }

  void read_image(const BagMessage& message, bool compressed) {
    ImageTopic& topic = bag_.images[message.channel->topic];
    const std::vector<std::uint8_t> head =
        first_bytes(message, compressed ? kJpegHead : kRosImageHead);
    refuse_packed(head);
    const auto read = compressed ? read_ros_compressed_image : read_ros_image;
    std::string encoding;
    const auto image = read(head, message.place.size, message.channel->encoding, &encoding);
    const bool other_size =
        image && !topic.messages.empty() && image->size != topic.messages.front().image.size;
    if (image && !other_size) {
      count();
      topic.messages.push_back(
          {*image, message.log_time, message.place, static_cast<std::uint32_t>(file_)});
      return;
    }
    if (topic.first_omitted.empty()) topic.first_omitted = where(message.place, file_);
    if (!image && topic.unreadable == 0) topic.encoding = encoding;
    ++(image ? topic.other_size : topic.unreadable);
  }

  /// Refuses recordings that are compressed message by message, because the heads of their messages
  /// are not readable.
  void refuse_packed(std::span<const std::uint8_t> head) const {
    constexpr std::array<std::uint8_t, 4> kZstd{0x28, 0xB5, 0x2F, 0xFD};
    if (head.size() >= kZstd.size() && std::equal(kZstd.begin(), kZstd.end(), head.begin()))
      refuse(path_, 0,
             "has individually compressed messages (compression_mode: MESSAGE), which are not "
             "supported; unpack them with `ros2 bag convert -i BAG -o OUT.yaml`, where OUT.yaml "
             "has `output_bags: [{uri: BAG_PLAIN, storage_id: mcap, all_topics: true}]`");
  }

  void read_info(const BagMessage& message) {
    const std::string& topic = message.channel->topic;
    if (bag_.infos.contains(topic)) return;
    if (auto info =
            read_ros_camera_info(first_bytes(message, kMaxBytes), message.channel->encoding))
      bag_.infos.emplace(topic, std::move(*info));
  }

  template <typename Read, typename Reading>
  void read_ins(const BagMessage& message, Read read, BagTopic<Reading>* topic) {
    const auto reading = read(first_bytes(message, kMaxBytes), message.channel->encoding);
    if (!reading) {
      ++topic->unreadable;
      return;
    }
    count();
    topic->messages.push_back(*reading);
  }

  void count() {
    if (++messages_ > kMaxMessages)
      refuse(path_, 0, "has more than {} images and INS samples; split the bag", kMaxMessages);
  }

  /// Replaces stamps of 0, which some drivers write, by the recording time minus the topic's usual
  /// delay.
  static void replace_zero_stamps(ImageTopic* topic) {
    std::vector<std::int64_t> delays;
    for (const BagImage& image : topic->messages)
      if (image.image.stamp.ns() != 0)
        if (std::int64_t delay = 0;
            !__builtin_sub_overflow(image.log_time, image.image.stamp.ns(), &delay))
          delays.push_back(delay);
    std::int64_t usual = 0;
    // In ns. A longer delay means that the clocks differ.
    constexpr std::int64_t kLongestDelay = 10'000'000'000;
    if (!delays.empty()) usual = median(std::span(delays));
    if (std::abs(usual) >= kLongestDelay) usual = 0;
    for (BagImage& image : topic->messages) {
      if (image.image.stamp.ns() != 0 || image.log_time <= kLongestDelay) continue;
      image.image.stamp = Stamp(image.log_time - usual);
      ++topic->unstamped;
    }
  }

  /// Drops the messages whose stamps do not increase.
  template <typename Message, typename StampOf>
  void put_in_order(BagTopic<Message>* topic, const StampOf& stamp_of) {
    std::vector<Stamp> stamps;
    for (const Message& message : topic->messages) stamps.push_back(stamp_of(message));
    const std::vector<std::size_t> kept = ascending(stamps);
    topic->backwards = stamps.size() - kept.size();
    for (std::size_t i = 0; i < kept.size(); ++i) topic->messages[i] = topic->messages[kept[i]];
    topic->messages.resize(kept.size());
  }

  [[nodiscard]] std::string where(const BagPlace& place, std::size_t file) const {
    const bool packed = place.chunk != BagPlace::kNoChunk;
    return fmt::format("{}, offset {}{}", bag_.files[file].name,
                       packed ? place.chunk : place.offset, packed ? " (of its chunk)" : "");
  }

  const fs::path& path_;
  BagIndex bag_{};
  // Index of the file that is being scanned.
  std::size_t file_ = 0;
  std::size_t messages_ = 0;
};

/// Converts one row of a layout that needs no neighbouring rows.
void row_to_grey(const RosImage& image, const std::uint8_t* in, int deep_bits,
                 std::uint8_t* out) noexcept {
  const int width = image.size.width;
  switch (image.layout) {
    case PixelLayout::grey16:
    case PixelLayout::bayer16:
      for (int x = 0; x < width; ++x, in += 2)
        out[x] = narrowed(static_cast<std::uint16_t>(in[image.big_endian ? 0 : 1] << 8U |
                                                     in[image.big_endian ? 1 : 0]),
                          deep_bits);
      return;
    case PixelLayout::rgb:
    case PixelLayout::bgr:
    case PixelLayout::rgba:
    case PixelLayout::bgra: {
      const bool three = image.layout == PixelLayout::rgb || image.layout == PixelLayout::bgr;
      const bool red_first = image.layout == PixelLayout::rgb || image.layout == PixelLayout::rgba;
      for (int x = 0; x < width; ++x, in += three ? 3 : 4)
        out[x] = luminance(in[red_first ? 0 : 2], in[1], in[red_first ? 2 : 0]);
      return;
    }
    case PixelLayout::luma_first:
    case PixelLayout::luma_second:
      in += image.layout == PixelLayout::luma_second ? 1 : 0;
      for (int x = 0; x < width; ++x, in += 2) out[x] = *in;
      return;
    case PixelLayout::grey:
    case PixelLayout::bayer:
    case PixelLayout::encoded:
    case PixelLayout::encoded_bayer:
      std::copy_n(in, width, out);
  }
}

}  // namespace

std::vector<BagFile> open_bag_files(BagFormat format, const fs::path& path) {
  std::vector<BagFile> files;
  for (const fs::path& file : list_files(format, path))
    files.push_back({file.filename().string(), format == BagFormat::sqlite
                                                   ? open_sqlite_bag(file)
                                                   : std::make_unique<FileBytes>(file)});
  return files;
}

BagIndex index_bag(BagFormat format, const fs::path& path, std::vector<BagFile> files) {
  return Indexer(format, path, std::move(files)).release_index();
}

BagImages::BagImages(BagFormat format, std::vector<BagFile> files,
                     std::array<std::string, 2> topics,
                     std::array<std::vector<BagImage>, 2> images) noexcept
    : format_(format),
      files_(std::move(files)),
      topics_(std::move(topics)),
      images_(std::move(images)) {}

std::string BagImages::name(std::size_t camera, std::size_t index) const {
  const std::string& topic = topics_[camera];
  return topic.substr(topic.starts_with('/') ? 1 : 0) + "#" + std::to_string(index);
}

const BagImage* BagImages::find(const std::string& image) const {
  std::size_t index = 0;
  if (!parse_whole(std::string_view(image).substr(image.rfind('#') + 1), &index)) return nullptr;
  for (std::size_t camera = 0; camera < 2; ++camera)
    if (index < images_[camera].size() && name(camera, index) == image)
      return &images_[camera][index];
  return nullptr;
}

ImageFileStatus BagImages::size(const std::string& name, ImageSize* size) const {
  const BagImage* entry = find(name);
  if (entry == nullptr) return ImageFileStatus::missing;
  *size = entry->image.size;
  return ImageFileStatus::ok;
}

std::shared_ptr<const std::vector<std::uint8_t>> BagImages::unpacked(const BagImage& entry) const {
  // Threads unpack one at a time, so that a second one finds the chunk here.
  const std::lock_guard lock(mutex_);
  for (const Unpacked& u : unpacked_)
    if (u.records && u.chunk == entry.place.chunk && u.file == entry.file) return u.records;
  unpacked_[1] = {};
  auto records = std::make_shared<std::vector<std::uint8_t>>();
  if (!unpack_chunk(format_, *files_[entry.file].bytes, entry.place.chunk, records.get()))
    return nullptr;
  unpacked_[1] = std::move(unpacked_[0]);
  unpacked_[0] = {entry.file, entry.place.chunk, std::move(records)};
  return unpacked_[0].records;
}

bool BagImages::load(const BagImage& entry, std::vector<std::uint8_t>* data) const {
  data->resize(entry.image.bytes);
  const std::uint64_t offset = entry.place.offset + entry.image.offset;
  if (entry.place.chunk == BagPlace::kNoChunk) return files_[entry.file].bytes->read(offset, *data);
  const auto records = unpacked(entry);
  return records && MemoryBytes(*records).read(offset, *data);
}

ImageFileStatus BagImages::decode(const std::string& name, ImageSize size, std::uint8_t* out,
                                  std::size_t stride, int deep_bits,
                                  std::vector<std::uint8_t>* work) const {
  const BagImage* entry = find(name);
  if (entry == nullptr) return ImageFileStatus::missing;
  const RosImage& image = entry->image;
  if (image.size != size) return ImageFileStatus::wrong_size;
  if (!load(*entry, work)) return ImageFileStatus::unreadable;
  const std::uint8_t* in = work->data();
  const auto width = static_cast<std::size_t>(size.width);
  const auto to_grey = [&](const std::uint8_t* mosaic, std::size_t step) {
    bayer_to_grey(mosaic, static_cast<std::ptrdiff_t>(step), size.width, size.height, out,
                  static_cast<std::ptrdiff_t>(stride));
  };
  if (image.layout == PixelLayout::encoded) return decode_grey(*work, size, out, stride, deep_bits);
  if (image.layout == PixelLayout::bayer) {
    to_grey(in, image.step);
    return ImageFileStatus::ok;
  }
  const bool mosaic =
      image.layout == PixelLayout::encoded_bayer || image.layout == PixelLayout::bayer16;
  std::vector<std::uint8_t> room(mosaic ? width * static_cast<std::size_t>(size.height) : 0);
  if (image.layout == PixelLayout::encoded_bayer) {
    if (const auto status = decode_grey(*work, size, room.data(), width, deep_bits);
        status != ImageFileStatus::ok)
      return status;
  } else {
    std::uint8_t* to = mosaic ? room.data() : out;
    for (int y = 0; y < size.height; ++y, in += image.step, to += mosaic ? width : stride)
      row_to_grey(image, in, deep_bits, to);
  }
  if (mosaic) to_grey(room.data(), width);
  return ImageFileStatus::ok;
}

}  // namespace vergence::app::detail
