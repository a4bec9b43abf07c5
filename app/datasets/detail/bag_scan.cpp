#include "app/datasets/detail/bag_scan.hpp"

#include <bzlib.h>
#include <fcntl.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <limits>

#include <sys/stat.h>

#include "app/datasets/detail/record_scanner.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

/// Returns the descriptor of the file; −1 if it cannot be opened. A thread keeps only its last file
/// open, because there may be more files than a process may open.
int opened(std::uint64_t number, const std::filesystem::path& file) noexcept {
  struct Last {
    std::uint64_t number = 0;
    int fd = -1;
    ~Last() {
      if (fd >= 0) ::close(fd);
    }
  };
  thread_local Last last;
  if (last.fd >= 0 && last.number == number) return last.fd;
  if (last.fd >= 0) ::close(last.fd);
  last.number = number;
  return last.fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

std::uint64_t next_number() noexcept {
  static std::atomic<std::uint64_t> number{0};
  return number.fetch_add(1, std::memory_order_relaxed);
}

bool decompress_zstd(std::span<const std::uint8_t> packed, std::span<std::uint8_t> out) noexcept {
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
  return ZSTD_isError(got) == 0 && got == out.size();
}

bool decompress_lz4(std::span<const std::uint8_t> packed, std::span<std::uint8_t> out) noexcept {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owner(
      context, &LZ4F_freeDecompressionContext);
  std::size_t in = 0, written = 0, hint = 1;
  while (in < packed.size() && hint != 0) {
    std::size_t consumed = packed.size() - in, given = out.size() - written;
    hint = LZ4F_decompress(context, out.data() + written, &given, packed.data() + in, &consumed,
                           nullptr);
    if (LZ4F_isError(hint) != 0 || (consumed == 0 && given == 0)) return false;
    in += consumed, written += given;
  }
  return hint == 0 && written == out.size();
}

bool decompress_bz2(std::span<const std::uint8_t> packed, std::span<std::uint8_t> out) noexcept {
  constexpr std::size_t kMax = std::numeric_limits<unsigned>::max();
  if (packed.size() > kMax || out.size() > kMax) return false;
  auto got = static_cast<unsigned>(out.size());
  // The library's interface lacks const, but it does not write to its source.
  auto* in = const_cast<char*>(reinterpret_cast<const char*>(packed.data()));
  return BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(out.data()), &got, in,
                                    static_cast<unsigned>(packed.size()), 0, 0) == BZ_OK &&
         got == out.size();
}

struct Compression {
  std::string_view name;
  bool (*decompress)(std::span<const std::uint8_t> packed, std::span<std::uint8_t> out) noexcept;
};
constexpr std::array kCompressions{Compression{"zstd", decompress_zstd},
                                   Compression{"lz4", decompress_lz4},
                                   Compression{"bz2", decompress_bz2}};

}  // namespace

FileBytes::FileBytes(const std::filesystem::path& file) : path_(file), number_(next_number()) {
  const int fd = opened(number_, path_);
  if (fd < 0) refuse(file, 0, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat about {};
  if (::fstat(fd, &about) != 0 || !S_ISREG(about.st_mode))
    refuse(file, 0, "is not a regular file; pass a bag");
  size_ = static_cast<std::uint64_t>(about.st_size);
}

bool FileBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
  if (offset > size_ || out.size() > size_ - offset) return false;
  const int fd = opened(number_, path_);
  for (std::size_t got = 0; got < out.size();) {
    const ssize_t n =
        ::pread(fd, out.data() + got, out.size() - got, static_cast<off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    got += static_cast<std::size_t>(n);
  }
  return true;
}

bool MemoryBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
  if (offset > bytes_.size() || out.size() > bytes_.size() - offset) return false;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  return true;
}

std::string plain_type(std::string_view type) {
  constexpr std::string_view kOfRos2 = "/msg/";
  std::string plain(type);
  if (const std::size_t at = plain.find(kOfRos2); at != std::string::npos)
    plain.replace(at, kOfRos2.size(), "/");
  return plain;
}

std::vector<std::uint8_t> first_bytes(const BagMessage& message, std::size_t most) {
  std::vector<std::uint8_t> bytes(std::min<std::size_t>(most, message.place.size));
  if (!message.bytes->read(message.place.offset, bytes)) bytes.clear();
  return bytes;
}

void BagScan::skip(std::uint64_t offset, std::string_view why) {
  ++skipped;
  if (first_broken) return;
  first_broken = offset;
  why_broken = why;
}

void BagScan::remark(const std::string& name, std::vector<std::string>* remarks) const {
  if (!finished)
    remarks->push_back(fmt::format(
        "{} is incomplete: it is read up to offset {}, the end of its last complete record", name,
        end));
  if (first_broken)
    remarks->push_back(
        fmt::format("{}: {} chunks or records are skipped; the first at offset {} is {}", name,
                    skipped, *first_broken, why_broken));
  if (orphans > 0)
    remarks->push_back(
        fmt::format("{}: {} messages of unknown channels are skipped", name, orphans));
}

std::optional<BagScan> scan_bag(BagFormat format, const ByteSource& file, const BagVisitor& each) {
  if (format == BagFormat::sqlite) return scan_sqlite(file, each);
  return format == BagFormat::mcap ? scan_mcap(file, each) : scan_rosbag(file, each);
}

bool unpack_chunk(BagFormat format, const ByteSource& file, std::uint64_t offset,
                  std::vector<std::uint8_t>* records) {
  // SQLite bags have no chunks.
  if (format == BagFormat::sqlite) return false;
  return format == BagFormat::mcap ? unpack_mcap_chunk(file, offset, records)
                                   : unpack_rosbag_chunk(file, offset, records);
}

std::string unpack(const ByteSource& file, const Chunk& chunk, std::vector<std::uint8_t>* records) {
  if (chunk.size > kMaxChunk || chunk.unpacked > kMaxChunk)
    return "a chunk larger than 64 MiB; write the bag with smaller chunks";
  const auto known = std::ranges::find(kCompressions, chunk.compression, &Compression::name);
  if (known == kCompressions.end())
    return fmt::format("a chunk of the compression \"{}\"; zstd, lz4, bz2 and none can be read",
                       chunk.compression.substr(0, 60));
  std::vector<std::uint8_t> packed(static_cast<std::size_t>(chunk.size));
  if (!file.read(chunk.offset, packed)) return "a chunk that cannot be read";
  records->resize(static_cast<std::size_t>(chunk.unpacked));
  if (!known->decompress(packed, *records))
    return "a chunk whose " + chunk.compression + " data do not unpack";
  if (chunk.crc != 0 && libdeflate_crc32(0, records->data(), records->size()) != chunk.crc)
    return "a chunk whose check sum fails";
  return "";
}

}  // namespace vergence::app::detail
