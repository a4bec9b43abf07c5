#include "app/datasets/image_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "app/datasets/detail/bmp.hpp"
#include "app/datasets/detail/jpeg.hpp"
#include "app/datasets/detail/netpbm.hpp"
#include "app/datasets/detail/png.hpp"

namespace vergence::app {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr off_t kMaxFile = off_t{256}
                           << 20;  // bytes; a 100-megapixel grey PNG that does not compress is less

ImageFileStatus size_of(Bytes b, ImageSize* size) noexcept {
  if (detail::is_png(b)) return detail::png_size(b, size);
  if (detail::is_jpeg(b)) return detail::jpeg_size(b, size);
  if (detail::is_bmp(b)) return detail::bmp_size(b, size);
  if (detail::is_netpbm(b)) return detail::netpbm_size(b, size);
  // A file of nothing, or of the first bytes of a signature, is a torn write; another content is
  // another kind of file.
  return detail::may_become_png(b) ? ImageFileStatus::torn : ImageFileStatus::not_an_image;
}

/// A descriptor that closes itself. Opening does not wait, as that of a pipe would.
class OpenFile {
 public:
  explicit OpenFile(const char* path) noexcept
      : fd_(::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
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
ImageFileStatus read_bytes(const std::filesystem::path& file, std::size_t limit,
                           std::vector<std::uint8_t>* bytes) {
  const OpenFile in(file.c_str());
  if (in.fd() < 0) {
    if (errno == EMFILE || errno == ENFILE) return ImageFileStatus::too_many_files;
    return errno == ENOENT || errno == ENOTDIR ? ImageFileStatus::missing
                                               : ImageFileStatus::unreadable;
  }
  struct stat about {};
  if (::fstat(in.fd(), &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > kMaxFile)
    return ImageFileStatus::unreadable;
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

bool is_image_name(std::string_view file) noexcept {
  constexpr std::array<std::string_view, 7> kEndings{".png", ".jpg", ".jpeg", ".bmp",
                                                     ".pgm", ".ppm", ".pnm"};
  const auto ends_so = [file](std::string_view ending) {
    return file.size() > ending.size() &&
           std::equal(ending.begin(), ending.end(),
                      file.end() - static_cast<std::ptrdiff_t>(ending.size()),
                      [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b | 0x20 : b); });
  };
  return !file.starts_with('.') && std::any_of(kEndings.begin(), kEndings.end(), ends_so);
}

const char* to_phrase(ImageFileStatus status) noexcept {
  switch (status) {
    case ImageFileStatus::ok:
      return "is as it should be";
    case ImageFileStatus::missing:
      return "is missing";
    case ImageFileStatus::unreadable:
      return "cannot be read";
    case ImageFileStatus::too_many_files:
      return "cannot be opened: this program or the machine has as many files open as it may "
             "(ulimit -n)";
    case ImageFileStatus::not_an_image:
      return "is no PNG, JPEG, BMP or PGM image";
    case ImageFileStatus::torn:
      return "is torn: it ends before the image is complete, or its check sums fail";
    case ImageFileStatus::undecodable:
      return "cannot be decoded: PNG of every kind, JPEG of 8-bit grey or three colours and "
             "uncompressed BMP of 8-bit grey or 24 bits can";
    case ImageFileStatus::wrong_size:
      return "has another size than the calibration";
  }
  return "";
}

ImageFileStatus read_image_file(const std::filesystem::path& file,
                                std::vector<std::uint8_t>* bytes) {
  return read_bytes(file, static_cast<std::size_t>(kMaxFile), bytes);
}

ImageFileStatus read_image_size(const std::filesystem::path& file, ImageSize* size) {
  std::vector<std::uint8_t> head;
  if (const auto status = read_bytes(file, detail::kPngHead, &head); status != ImageFileStatus::ok)
    return status;
  if (detail::is_jpeg(head) || detail::is_netpbm(head))
    if (const auto status =
            read_bytes(file, std::max(detail::kJpegHead, detail::kNetpbmHead), &head);
        status != ImageFileStatus::ok)
      return status;
  return size_of(head, size);
}

ImageFileStatus read_image_size(std::span<const std::uint8_t> head, ImageSize* size) noexcept {
  return size_of(head, size);
}

ImageFileStatus check_image(std::span<const std::uint8_t> bytes, ImageSize* size) noexcept {
  if (const auto status = size_of(bytes, size); status != ImageFileStatus::ok) return status;
  if (detail::is_bmp(bytes)) return detail::check_bmp(bytes);
  if (detail::is_netpbm(bytes)) return detail::check_netpbm(bytes);
  return detail::is_png(bytes) ? detail::check_png(bytes) : detail::check_jpeg(bytes);
}

std::optional<std::uint16_t> peak_of_deep_image(std::span<const std::uint8_t> bytes) {
  ImageSize size;
  constexpr std::size_t kDepthAt = 24;  // of the header: other depths are not worth decoding
  if (check_image(bytes, &size) != ImageFileStatus::ok) return std::uint16_t{0};
  if (detail::is_netpbm(bytes)) return detail::netpbm_peak(bytes);
  if (!detail::is_png(bytes) || bytes.size() <= kDepthAt || bytes[kDepthAt] != 16)
    return std::nullopt;
  const auto width = static_cast<std::size_t>(size.width);
  std::vector<std::uint8_t> pixels(width * static_cast<std::size_t>(size.height));
  detail::DeepSamples deep;
  return detail::decode_png(bytes, size, pixels.data(), width, &deep) == ImageFileStatus::ok
             ? deep.peak
             : std::uint16_t{0};
}

ImageFileStatus decode_grey(std::span<const std::uint8_t> bytes, ImageSize size, std::uint8_t* out,
                            std::size_t stride, int deep_bits) noexcept {
  ImageSize found;
  if (const auto status = check_image(bytes, &found); status != ImageFileStatus::ok) return status;
  if (found != size) return ImageFileStatus::wrong_size;
  if (detail::is_bmp(bytes)) return detail::decode_bmp(bytes, size, out, stride);
  if (detail::is_netpbm(bytes)) {
    detail::decode_netpbm(bytes, out, stride, deep_bits);
    return ImageFileStatus::ok;
  }
  detail::DeepSamples deep{deep_bits};
  return detail::is_png(bytes) ? detail::decode_png(bytes, size, out, stride, &deep)
                               : detail::decode_jpeg(bytes, size, out, stride);
}

}  // namespace vergence::app
