// Images that are not compressed: BMP, PGM and PPM.
#include "app/datasets/detail/image_kinds.hpp"

namespace vergence::app::detail {
namespace {

// Offsets of the fields: the file header has 14 bytes, the information header follows.
constexpr std::size_t kPixelsAt = 10, kHeaderSize = 14, kWidth = 18, kHeight = 22, kBits = 28,
                      kCompression = 30, kColours = 46;
// Size of the header up to the image size, in bytes.
constexpr std::size_t kBmpHead = 26;
constexpr std::size_t kFileHeader = 14, kMinHeader = 40, kWholeHead = kFileHeader + kMinHeader;

std::uint32_t u16(ImageBytes b, std::size_t at) noexcept {
  return whole_at(b, at, 2, std::endian::little);
}
std::uint32_t u32(ImageBytes b, std::size_t at) noexcept {
  return whole_at(b, at, 4, std::endian::little);
}

/// A negative height means that the first row is the top one.
bool top_down(ImageBytes b) noexcept { return (u32(b, kHeight) & 0x80000000U) != 0; }
/// True for uncompressed rows. With bit fields, 32 bits are blue, green, red as usual.
bool is_plain(ImageBytes b) noexcept {
  constexpr std::uint32_t kBitFields = 3;
  return u32(b, kCompression) == 0 || (u32(b, kCompression) == kBitFields && u16(b, kBits) == 32);
}
/// Grey value of one pixel (blue, green, red).
std::uint8_t to_grey(const std::uint8_t* bgr) noexcept { return luminance(bgr[2], bgr[1], bgr[0]); }

/// Grey levels of the palette's indices; without a palette the indices are grey levels.
std::array<std::uint8_t, 256> read_palette(ImageBytes b) noexcept {
  std::array<std::uint8_t, 256> grey{};
  const std::size_t first = kFileHeader + u32(b, kHeaderSize), end = u32(b, kPixelsAt);
  const std::size_t count = u32(b, kColours) == 0 ? 256 : u32(b, kColours),
                    there = first < end ? (end - first) / 4 : 0;
  for (std::size_t i = 0; i < grey.size(); ++i)
    grey[i] = there == 0                   ? static_cast<std::uint8_t>(i)
              : i < std::min(count, there) ? to_grey(&b[first + 4 * i])
                                           : std::uint8_t{0};
  return grey;
}

ImageFileStatus bmp_size(ImageBytes b, ImageSize* size) noexcept {
  if (b.size() < kBmpHead) return ImageFileStatus::truncated;
  if (u32(b, kHeaderSize) < kMinHeader)
    // This is an older kind, or no BMP.
    return ImageFileStatus::not_an_image;
  const std::uint32_t width = u32(b, kWidth),
                      height = top_down(b) ? 0U - u32(b, kHeight) : u32(b, kHeight);
  return accept_size(width, height, size);
}

ImageFileStatus decode_bmp(ImageBytes b, ImageSize size, std::uint8_t* out, std::size_t stride,
                           int /*deep_bits*/) noexcept {
  if (b.size() < kWholeHead) return ImageFileStatus::truncated;
  const std::uint32_t bits = u16(b, kBits);
  if (!is_plain(b) || (bits != 8 && bits != 24 && bits != 32)) return ImageFileStatus::undecodable;
  const std::size_t width = static_cast<std::size_t>(size.width),
                    height = static_cast<std::size_t>(size.height);
  const std::size_t row = (width * bits + 31) / 32 * 4, pixels = u32(b, kPixelsAt);
  if (pixels > b.size() || row * height > b.size() - pixels) return ImageFileStatus::truncated;
  const std::array<std::uint8_t, 256> grey =
      bits == 8 ? read_palette(b) : std::array<std::uint8_t, 256>{};
  for (std::size_t y = 0; y < height; ++y, out += stride) {
    const std::uint8_t* from = &b[pixels + (top_down(b) ? y : height - 1 - y) * row];
    for (std::size_t x = 0; x < width; ++x)
      out[x] = bits == 8 ? grey[from[x]] : to_grey(from + bits / 8 * x);
  }
  return ImageFileStatus::ok;
}

// The header ends within this many bytes, comments included.
constexpr std::size_t kNetpbmHead = 4096;

struct NetpbmHeader {
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
ImageFileStatus read_header(ImageBytes bytes, NetpbmHeader* header) noexcept {
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
  NetpbmHeader header;
  const ImageFileStatus status = read_header(head, &header);
  *size = header.size;
  return status;
}

ImageFileStatus decode_netpbm(ImageBytes bytes, ImageSize /*size*/, std::uint8_t* out,
                              std::size_t stride, int deep_bits) noexcept {
  NetpbmHeader header;
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

const ImageKind kBmp{kBmpHead, {"BM", "BM"}, bmp_size, decode_bmp};
const ImageKind kNetpbm{kNetpbmHead, {"P5", "P6"}, netpbm_size, decode_netpbm};

}  // namespace vergence::app::detail
