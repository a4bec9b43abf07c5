#include <bzlib.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
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

bool decompress(std::string_view name, std::span<const std::uint8_t> packed,
                std::span<std::uint8_t> records) noexcept {
  if (name == "zstd") return decompress_zstd(packed, records);
  if (name == "bz2") return decompress_bz2(packed, records);
  return name == "lz4" && decompress_lz4(packed, records);
}

}  // namespace

std::string unpack(const ByteSource& file, const Chunk& chunk, const Compressions& supported,
                   std::vector<std::uint8_t>* records) {
  if (chunk.size > kMaxChunk || chunk.unpacked > kMaxChunk)
    return "a chunk larger than 64 MiB; write the bag with smaller chunks";
  if (std::ranges::find(supported, chunk.compression) == supported.end())
    return fmt::format("a chunk of the compression \"{}\"; {}, {} and none can be read",
                       chunk.compression.substr(0, 60), supported[0], supported[1]);
  std::vector<std::uint8_t> packed(static_cast<std::size_t>(chunk.size));
  if (!file.read(chunk.offset, packed)) return "a chunk that cannot be read";
  records->resize(static_cast<std::size_t>(chunk.unpacked));
  if (!decompress(chunk.compression, packed, *records))
    return "a chunk whose " + chunk.compression + " data do not unpack";
  if (chunk.crc != 0 && libdeflate_crc32(0, records->data(), records->size()) != chunk.crc)
    return "a chunk whose check sum fails";
  return "";
}

}  // namespace vergence::app::detail
