#include "app/datasets/detail/image_kinds.hpp"

namespace vergence::app::detail {
namespace {

// The header ends within this many bytes, comments included.
constexpr std::size_t kNetpbmHead = 4096;

struct Header {
  ImageSize size{};
  // Maximum sample.
  std::uint32_t largest = 0;
  // Samples per pixel.
  std::size_t samples = 1;
  // Offset of the pixels.
  std::size_t begin = 0;
  [[nodiscard]] std::size_t bytes_a_sample() const { return largest > 255 ? 2 : 1; }
  [[nodiscard]] std::size_t row() const {
    return static_cast<std::size_t>(size.width) * samples * bytes_a_sample();
  }
};

bool is_blank(std::uint8_t c) noexcept { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Reads three integers after the two letters. They are separated by blanks and comments, and one
/// blank follows them.
ImageFileStatus read_header(ImageBytes bytes, Header* header) noexcept {
  std::array<std::uint32_t, 3> numbers{};
  std::size_t at = 2;
  if (bytes.size() > at && !is_blank(bytes[at]) && bytes[at] != '#')
    return ImageFileStatus::not_an_image;
  for (std::uint32_t& number : numbers) {
    while (at < bytes.size() && (is_blank(bytes[at]) || bytes[at] == '#')) {
      if (bytes[at] == '#')
        while (at < bytes.size() && bytes[at] != '\n') ++at;
      else
        ++at;
    }
    const std::size_t first = at;
    for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9' && at - first < 6; ++at)
      number = 10 * number + (bytes[at] - std::uint32_t{'0'});
    if (at == bytes.size()) return ImageFileStatus::truncated;
    if (at == first || !is_blank(bytes[at])) return ImageFileStatus::not_an_image;
  }
  if (numbers[2] == 0 || numbers[2] > 65535) return ImageFileStatus::not_an_image;
  header->largest = numbers[2];
  header->samples = bytes[1] == '6' ? 3 : 1;
  header->begin = at + 1;
  return accept_size(numbers[0], numbers[1], &header->size);
}

ImageFileStatus netpbm_size(ImageBytes head, ImageSize* size) noexcept {
  Header header;
  const ImageFileStatus status = read_header(head, &header);
  *size = header.size;
  return status;
}

ImageFileStatus decode_netpbm(ImageBytes bytes, ImageSize /*size*/, std::uint8_t* out,
                              std::size_t stride, int deep_bits) noexcept {
  Header header;
  if (read_header(bytes, &header) != ImageFileStatus::ok ||
      bytes.size() - std::min(header.begin, bytes.size()) <
          header.row() * static_cast<std::size_t>(header.size.height))
    return ImageFileStatus::truncated;
  const std::uint8_t* in = bytes.data() + header.begin;
  const std::size_t width = static_cast<std::size_t>(header.size.width),
                    step = header.bytes_a_sample();
  for (int y = 0; y < header.size.height; ++y, in += header.row(), out += stride)
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t* pixel = in + x * header.samples * step;
      if (header.samples == 3) {
        // The upper 8 bits of deep samples are used.
        out[x] = luminance(pixel[0], pixel[step], pixel[2 * step]);
      } else if (step == 2) {
        out[x] = narrowed(static_cast<std::uint16_t>(pixel[0] << 8U | pixel[1]), deep_bits);
      } else {
        out[x] = pixel[0];
      }
    }
  return ImageFileStatus::ok;
}

}  // namespace

const ImageKind kNetpbm{kNetpbmHead, {"P5", "P6"}, netpbm_size, decode_netpbm};

}  // namespace vergence::app::detail
