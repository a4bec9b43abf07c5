#include <bzlib.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "app/datasets/detail/record_scanner.hpp"

namespace vergence::app::detail {
namespace {

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
