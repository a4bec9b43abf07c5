#pragma once
#include <map>
#include <mutex>

#include "app/datasets/detail/ros_messages.hpp"

/// Content of a ROS recording by topic, and its images.
namespace vergence::app::detail {

/// Position of an image in a bag; its pixels stay in the file.
struct BagImage {
  RosImage image{};
  /// Recording time in ns.
  std::int64_t log_time = 0;
  BagPlace place{};
  /// Index of the bag's file.
  std::uint32_t file = 0;
};

/// Messages of a topic with strictly increasing stamps; images are of one size.
template <typename Message>
struct BagTopic {
  std::vector<Message> messages{};
  /// Numbers of omitted messages, and the first position: file and offset.
  std::size_t unreadable = 0, other_size = 0, backwards = 0;
  std::string first_omitted{};
  /// Encoding of the first unreadable image, as named in it.
  std::string encoding{};
  /// Number of images with stamp 0, which have the recording time instead.
  std::size_t unstamped = 0;
};
using ImageTopic = BagTopic<BagImage>;

/// File of a bag.
struct BagFile {
  std::string name{};
  std::unique_ptr<const ByteSource> bytes{};
};

struct BagIndex {
  BagFormat format{};
  std::vector<BagFile> files{};
  /// By topic, as the next ones.
  std::map<std::string, ImageTopic> images{};
  std::map<std::string, RosCameraInfo> infos{};
  std::map<std::string, BagTopic<InsRecord>> fixes{};
  /// Messages without orientation count as unreadable.
  std::map<std::string, BagTopic<RosAttitude>> attitudes{};
  /// Some topics that are not read, each with its type.
  std::vector<std::string> others{};
  /// Messages.
  std::vector<std::string> remarks{};
};

/// Files of a bag: one, or those of a directory in recording order. Throws InputError for a missing
/// file or a directory without the format.
[[nodiscard]] std::vector<BagFile> open_bag_files(BagFormat format,
                                                  const std::filesystem::path& path);

/// Indexes all messages of a bag's files; `path` is for messages. Uses 80 bytes per image, 60 to
/// 180 per INS sample. Throws InputError if a file does not begin as the format requires, or there
/// are too many images or samples.
[[nodiscard]] BagIndex index_bag(BagFormat format, const std::filesystem::path& path,
                                 std::vector<BagFile> files);

/// Images of two topics of a bag by their names in a sequence, loaded on request. The last two
/// chunks stay unpacked, because the images of a pair are mostly in one. Thread-safe with a
/// workspace per thread. Uses some 80 bytes per image, and at most four times kMaxChunk. Errors as
/// in image_file.hpp, and std::bad_alloc.
class BagImages {
 public:
  /// `topics` and `images` are left and right.
  BagImages(BagFormat format, std::vector<BagFile> files, std::array<std::string, 2> topics,
            std::array<std::vector<BagImage>, 2> images) noexcept;

  /// Returns the name of image `index` of camera `camera`: `left/image_raw#12`.
  [[nodiscard]] std::string name(std::size_t camera, std::size_t index) const;
  /// → ok, missing
  [[nodiscard]] ImageFileStatus size(const std::string& name, ImageSize* size) const;
  /// Same contract as decode_grey(); *work is reused memory.
  [[nodiscard]] ImageFileStatus decode(const std::string& name, ImageSize size, std::uint8_t* out,
                                       std::size_t stride, int deep_bits,
                                       std::vector<std::uint8_t>* work) const;

 private:
  struct Unpacked {
    std::uint32_t file = 0;
    std::uint64_t chunk = BagPlace::kNoChunk;
    std::shared_ptr<const std::vector<std::uint8_t>> records{};
  };
  /// Returns null if there is no such image.
  [[nodiscard]] const BagImage* find(const std::string& image) const;
  [[nodiscard]] bool load(const BagImage& entry, std::vector<std::uint8_t>* data) const;
  /// Records of the image's chunk; null: it does not unpack.
  [[nodiscard]] std::shared_ptr<const std::vector<std::uint8_t>> unpacked(
      const BagImage& entry) const;

  BagFormat format_;
  std::vector<BagFile> files_;
  std::array<std::string, 2> topics_;
  std::array<std::vector<BagImage>, 2> images_;
  // Guards unpacked_.
  mutable std::mutex mutex_;
  // The newer one is first.
  mutable std::array<Unpacked, 2> unpacked_;
};

}  // namespace vergence::app::detail
