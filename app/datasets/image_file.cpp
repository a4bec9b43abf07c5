#include "app/datasets/image_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "app/datasets/detail/bmp.hpp"

namespace vergence::app {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kPngHead = 33;                        // signature and the whole IHDR chunk
constexpr std::size_t kHeadBytes = std::size_t{256} << 10;  // a JPEG's size stands behind its metadata: four segments of 64 KiB
constexpr off_t kMaxFile = off_t{256} << 20;                // bytes; a 100-megapixel grey PNG that does not compress is less
constexpr std::uint32_t kMaxSide = 1U << 15;                // px

std::uint32_t big_endian_32(Bytes b, std::size_t at) noexcept {
  return (std::uint32_t{b[at]} << 24U) | (std::uint32_t{b[at + 1]} << 16U) | (std::uint32_t{b[at + 2]} << 8U) | b[at + 3];
}
std::uint32_t big_endian_16(Bytes b, std::size_t at) noexcept { return (std::uint32_t{b[at]} << 8U) | b[at + 1]; }

bool is_png(Bytes b) noexcept {
  return b.size() >= kPngSignature.size() && std::equal(kPngSignature.begin(), kPngSignature.end(), b.begin());
}
bool is_jpeg(Bytes b) noexcept { return b.size() >= 3 && b[0] == 0xff && b[1] == 0xd8 && b[2] == 0xff; }

ImageFileStatus accept_size(std::uint32_t width, std::uint32_t height, ImageSize* size) noexcept {
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide) return ImageFileStatus::not_an_image;
  *size = {static_cast<int>(width), static_cast<int>(height)};
  return ImageFileStatus::ok;
}

ImageFileStatus png_size(Bytes b, ImageSize* size) noexcept {
  if (b.size() < kPngHead) return ImageFileStatus::torn;
  if (std::memcmp(&b[12], "IHDR", 4) != 0) return ImageFileStatus::torn;
  return accept_size(big_endian_32(b, 16), big_endian_32(b, 20), size);
}

/// Every chunk with its check sum, up to IEND; what follows it is nobody's business.
ImageFileStatus check_png(Bytes b) noexcept {
  constexpr std::size_t kFrame = 12;  // length, type, check sum
  std::size_t at = kPngSignature.size();
  bool pixels = false;
  while (b.size() - at >= kFrame) {
    const std::size_t length = big_endian_32(b, at);
    if (length > b.size() - at - kFrame) return ImageFileStatus::torn;
    const auto sum = crc32(0, &b[at + 4], static_cast<uInt>(length + 4));
    if (sum != big_endian_32(b, at + 8 + length)) return ImageFileStatus::torn;
    if (std::memcmp(&b[at + 4], "IDAT", 4) == 0) pixels = true;
    if (std::memcmp(&b[at + 4], "IEND", 4) == 0) return pixels ? ImageFileStatus::ok : ImageFileStatus::torn;
    at += length + kFrame;
  }
  return ImageFileStatus::torn;
}

bool is_frame_header(std::uint8_t marker) noexcept {  // SOF0 … SOF15 without DHT, JPG, DAC
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

ImageFileStatus jpeg_size(Bytes b, ImageSize* size) noexcept {
  std::size_t at = 2;
  while (at + 9 <= b.size()) {
    if (b[at] != 0xff) return ImageFileStatus::torn;
    if (b[at + 1] == 0xff) {  // fill byte
      ++at;
      continue;
    }
    if (is_frame_header(b[at + 1])) return accept_size(big_endian_16(b, at + 7), big_endian_16(b, at + 5), size);
    at += 2 + std::max<std::size_t>(2, big_endian_16(b, at + 2));
  }
  return ImageFileStatus::torn;
}

/// The end marker, followed by nothing but the zeros that some cameras fill up with.
ImageFileStatus check_jpeg(Bytes b) noexcept {
  std::size_t end = b.size();
  while (end > 2 && b[end - 1] == 0) --end;
  return b[end - 2] == 0xff && b[end - 1] == 0xd9 ? ImageFileStatus::ok : ImageFileStatus::torn;
}

ImageFileStatus size_of(Bytes b, ImageSize* size) noexcept {
  if (is_png(b)) return png_size(b, size);
  if (is_jpeg(b)) return jpeg_size(b, size);
  if (detail::is_bmp(b)) return detail::bmp_size(b, size);
  // A file of nothing, or of the first bytes of a signature, is a torn write; another content is another kind of file.
  const std::size_t n = std::min(b.size(), kPngSignature.size());
  const bool begins = std::equal(b.begin(), b.begin() + static_cast<std::ptrdiff_t>(n), kPngSignature.begin());
  return begins ? ImageFileStatus::torn : ImageFileStatus::not_an_image;
}

/// A descriptor that closes itself.
class OpenFile {
 public:
  explicit OpenFile(const char* path) noexcept : fd_(::open(path, O_RDONLY | O_CLOEXEC)) {}
  ~OpenFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

/// Up to `limit` bytes from the file's start.
ImageFileStatus read_bytes(const std::filesystem::path& file, std::size_t limit, std::vector<std::uint8_t>* bytes) {
  const OpenFile in(file.c_str());
  if (in.fd() < 0) return errno == ENOENT || errno == ENOTDIR ? ImageFileStatus::missing : ImageFileStatus::unreadable;
  struct stat about {};
  if (::fstat(in.fd(), &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > kMaxFile) return ImageFileStatus::unreadable;
  bytes->resize(std::min(limit, static_cast<std::size_t>(about.st_size)));
  std::size_t got = 0;
  while (got < bytes->size()) {
    const ssize_t n = ::read(in.fd(), bytes->data() + got, bytes->size() - got);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return ImageFileStatus::unreadable;
    if (n == 0) break;  // became shorter meanwhile: the checks of the content see it
    got += static_cast<std::size_t>(n);
  }
  bytes->resize(got);
  return ImageFileStatus::ok;
}

}  // namespace

const char* to_phrase(ImageFileStatus status) noexcept {
  switch (status) {
    case ImageFileStatus::ok:
      return "is as it should be";
    case ImageFileStatus::missing:
      return "is missing";
    case ImageFileStatus::unreadable:
      return "cannot be read";
    case ImageFileStatus::not_an_image:
      return "is no PNG, JPEG or BMP image";
    case ImageFileStatus::torn:
      return "is torn: it ends before the image is complete, or its check sums fail";
    case ImageFileStatus::undecodable:
      return "cannot be decoded";
    case ImageFileStatus::wrong_size:
      return "has another size than the calibration";
  }
  return "";
}

ImageFileStatus read_image_file(const std::filesystem::path& file, std::vector<std::uint8_t>* bytes) {
  return read_bytes(file, static_cast<std::size_t>(kMaxFile), bytes);
}

ImageFileStatus read_image_size(const std::filesystem::path& file, ImageSize* size) {
  std::vector<std::uint8_t> head;
  if (const auto status = read_bytes(file, kPngHead, &head); status != ImageFileStatus::ok) return status;
  if (is_jpeg(head))
    if (const auto status = read_bytes(file, kHeadBytes, &head); status != ImageFileStatus::ok) return status;
  return size_of(head, size);
}

ImageFileStatus check_image(std::span<const std::uint8_t> bytes, ImageSize* size) noexcept {
  if (const auto status = size_of(bytes, size); status != ImageFileStatus::ok) return status;
  if (detail::is_bmp(bytes)) return detail::check_bmp(bytes);
  return is_png(bytes) ? check_png(bytes) : check_jpeg(bytes);
}

ImageFileStatus decode_grey(std::span<const std::uint8_t> bytes, ImageSize size, std::uint8_t* out, std::size_t stride) noexcept {
  ImageSize found;
  if (const auto status = check_image(bytes, &found); status != ImageFileStatus::ok) return status;
  if (found != size) return ImageFileStatus::wrong_size;
  if (detail::is_bmp(bytes)) return detail::decode_bmp(bytes, size, out, stride);
  try {
    // The decoder asks for pixels of this size and type and finds them there already: it writes into the slot itself.
    cv::Mat image(size.height, size.width, CV_8UC1, out, stride);
    const cv::Mat file(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<std::uint8_t*>(bytes.data()));
    cv::imdecode(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION, &image);
    if (image.empty() || image.data != out) return ImageFileStatus::undecodable;
  } catch (...) {  // cv::Exception, bad_alloc: whatever the content provoked
    return ImageFileStatus::undecodable;
  }
  return ImageFileStatus::ok;
}

}  // namespace vergence::app
