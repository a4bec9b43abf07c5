#include "app/datasets/image_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>

#include "app/datasets/detail/image_kinds.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/runtime/file_descriptor.hpp"

namespace vergence::app {
namespace {

using Bytes = std::span<const std::uint8_t>;

// In bytes. An incompressible grey PNG of 100 megapixels is smaller.
constexpr off_t kMaxFile = off_t{256} << 20;

/// Returns null for unsupported kinds.
const detail::ImageKind* detect_kind(Bytes bytes) noexcept {
  for (const detail::ImageKind* kind :
       {&detail::kPng, &detail::kJpeg, &detail::kBmp, &detail::kNetpbm})
    for (const std::string_view begin : kind->begins)
      if (std::ranges::equal(bytes.first(std::min(bytes.size(), begin.size())), begin, {}, {},
                             [](char c) { return static_cast<std::uint8_t>(c); }))
        return kind;
  return nullptr;
}

/// Reads up to `limit` bytes from the file's start.
ImageFileStatus read_bytes(const std::filesystem::path& file, std::size_t limit,
                           std::vector<std::uint8_t>* bytes) {
  // O_NONBLOCK keeps open() from blocking on a pipe.
  const FileDescriptor in(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!in) {
    if (errno == EMFILE || errno == ENFILE) return ImageFileStatus::too_many_files;
    return errno == ENOENT || errno == ENOTDIR ? ImageFileStatus::missing
                                               : ImageFileStatus::unreadable;
  }
  struct stat about {};
  if (::fstat(in.get(), &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > kMaxFile)
    return ImageFileStatus::unreadable;
  bytes->resize(std::min(limit, static_cast<std::size_t>(about.st_size)));
  std::size_t got = 0;
  while (got < bytes->size()) {
    const ssize_t n = ::read(in.get(), bytes->data() + got, bytes->size() - got);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return ImageFileStatus::unreadable;
    // The file became shorter; the checks of the content detect it.
    if (n == 0) break;
    got += static_cast<std::size_t>(n);
  }
  bytes->resize(got);
  return ImageFileStatus::ok;
}

}  // namespace

bool is_image_name(std::string_view file) {
  constexpr std::array<std::string_view, 7> kEndings{".png", ".jpg", ".jpeg", ".bmp",
                                                     ".pgm", ".ppm", ".pnm"};
  const std::string name = detail::lower(file);
  return !name.starts_with('.') && std::ranges::any_of(kEndings, [&](std::string_view ending) {
    return name.ends_with(ending);
  });
}

const char* to_phrase(ImageFileStatus status) noexcept {
  constexpr std::array kPhrases{
      "is valid",
      "is missing",
      "cannot be read",
      "cannot be opened, because the limit of open files is reached (ulimit -n)",
      "is not a PNG, JPEG, BMP or PGM image",
      "is truncated or damaged: it ends too early, or a checksum is wrong",
      "cannot be decoded; use PNG, JPEG (8-bit grey or three colours), PGM or uncompressed BMP (8, "
      "24 or 32 bits)",
      "differs in size from the calibration"};
  return kPhrases[static_cast<std::size_t>(status)];
}

ImageFileStatus read_image_file(const std::filesystem::path& file,
                                std::vector<std::uint8_t>* bytes) {
  return read_bytes(file, static_cast<std::size_t>(kMaxFile), bytes);
}

ImageFileStatus read_image_size(const std::filesystem::path& file, ImageSize* size) {
  std::vector<std::uint8_t> head;
  std::size_t enough = detail::kPng.head;
  if (const auto status = read_bytes(file, enough, &head); status != ImageFileStatus::ok)
    return status;
  if (const auto* kind = detect_kind(head); kind != nullptr && kind->head > enough)
    if (const auto status = read_bytes(file, kind->head, &head); status != ImageFileStatus::ok)
      return status;
  return read_image_size(head, size);
}

ImageFileStatus read_image_size(Bytes head, ImageSize* size) noexcept {
  if (const auto* kind = detect_kind(head)) return kind->size(head, size);
  return head.empty() ? ImageFileStatus::truncated : ImageFileStatus::not_an_image;
}

ImageFileStatus decode_grey(Bytes bytes, ImageSize size, std::uint8_t* out, std::size_t stride,
                            int deep_bits) noexcept {
  ImageSize found;
  if (const auto status = read_image_size(bytes, &found); status != ImageFileStatus::ok)
    return status;
  if (found != size) return ImageFileStatus::wrong_size;
  return detect_kind(bytes)->decode(bytes, size, out, stride, deep_bits);
}

}  // namespace vergence::app
