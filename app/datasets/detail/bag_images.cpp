#include "app/datasets/detail/bag_images.hpp"

#include <charconv>

#include "app/datasets/detail/image_kinds.hpp"
#include "core/types/bayer.hpp"

namespace vergence::app::detail {
namespace {

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

const BagImage* BagImages::find(const std::string& name, std::size_t* camera) const noexcept {
  const std::size_t mark = name.rfind('#');
  if (mark == std::string::npos) return nullptr;
  std::size_t index = 0;
  if (std::from_chars(name.data() + mark + 1, name.data() + name.size(), index).ec != std::errc{})
    return nullptr;
  for (*camera = 0; *camera < 2; ++*camera) {
    std::string_view topic = topics_[*camera];
    if (topic.starts_with('/')) topic.remove_prefix(1);
    if (topic == std::string_view(name).substr(0, mark))
      return index < images_[*camera].size() ? &images_[*camera][index] : nullptr;
  }
  return nullptr;
}

ImageFileStatus BagImages::size(const std::string& name, ImageSize* size) const {
  std::size_t camera = 0;
  const BagImage* entry = find(name, &camera);
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
  std::size_t camera = 0;
  const BagImage* entry = find(name, &camera);
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
