#include "app/datasets/detail/bag_images.hpp"

#include <algorithm>
#include <charconv>

#include "core/types/bayer.hpp"

namespace vergence::app::detail {
namespace {

/// Luminance of ITU-R BT.601 in 8 bits, as JPEG has it. `red`, `blue`: place of the colours in a
/// pixel.
void colour_to_grey(const std::uint8_t* row, int width, std::size_t red, std::size_t blue,
                    std::uint8_t* out) noexcept {
  for (int x = 0; x < width; ++x, row += 3)
    out[x] =
        static_cast<std::uint8_t>((77U * row[red] + 150U * row[1] + 29U * row[blue] + 128U) >> 8U);
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
  // One at a time: who comes second for the same chunk finds it here.
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

ImageFileStatus BagImages::encoded(const std::string& name,
                                   std::vector<std::uint8_t>* bytes) const {
  std::size_t camera = 0;
  const BagImage* entry = find(name, &camera);
  if (entry == nullptr) return ImageFileStatus::missing;
  if (entry->image.layout != PixelLayout::encoded) return ImageFileStatus::not_an_image;
  return load(*entry, bytes) ? ImageFileStatus::ok : ImageFileStatus::unreadable;
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
  switch (image.layout) {
    case PixelLayout::encoded:
      return decode_grey(*work, size, out, stride, deep_bits);
    case PixelLayout::bayer:
      bayer_to_grey(in, image.step, size.width, size.height, out,
                    static_cast<std::ptrdiff_t>(stride));
      return ImageFileStatus::ok;
    case PixelLayout::grey:
    case PixelLayout::rgb:
    case PixelLayout::bgr:
      break;
  }
  for (int y = 0; y < size.height; ++y, in += image.step, out += stride) {
    if (image.layout == PixelLayout::grey)
      std::copy_n(in, size.width, out);
    else
      colour_to_grey(in, size.width, image.layout == PixelLayout::rgb ? 0 : 2,
                     image.layout == PixelLayout::rgb ? 2 : 0, out);
  }
  return ImageFileStatus::ok;
}

}  // namespace vergence::app::detail
