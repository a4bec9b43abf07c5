#include "app/recording/png_encoder.hpp"

#include <libdeflate.h>

#include <array>
#include <cstring>
#include <new>

namespace vergence::app {
namespace {

constexpr std::array<std::uint8_t, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kHeader = 13;  // bytes of IHDR's content
constexpr std::size_t kAround = 12;  // of a chunk: length and type before it, check sum behind it
constexpr int kQuick = 1;            // compression, of 12
constexpr std::uint8_t kSub = 1;     // filter: difference from the pixel to the left

std::size_t filtered_bytes(int width, int height) noexcept {
  return (static_cast<std::size_t>(width) + 1) * static_cast<std::size_t>(height);
}

void put_be32(std::uint32_t value, std::uint8_t* to) noexcept {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

/// Around a content of `size` bytes that lies at `chunk` + 8. → bytes of the chunk
std::size_t close_chunk(const char* type, std::size_t size, std::uint8_t* chunk) noexcept {
  put_be32(static_cast<std::uint32_t>(size), chunk);
  std::memcpy(chunk + 4, type, 4);
  put_be32(libdeflate_crc32(0, chunk + 4, 4 + size), chunk + 8 + size);
  return kAround + size;
}

}  // namespace

void PngEncoder::Release::operator()(libdeflate_compressor* c) const noexcept {
  libdeflate_free_compressor(c);
}

PngEncoder::PngEncoder(int width, int height)
    : filtered_(filtered_bytes(width, height)), deflate_(libdeflate_alloc_compressor(kQuick)) {
  if (!deflate_) throw std::bad_alloc();
}

PngEncoder::~PngEncoder() = default;

std::size_t PngEncoder::most_bytes(int width, int height) noexcept {
  // Its bound does not depend on the compressor.
  return kSignature.size() + 3 * kAround + kHeader +
         libdeflate_zlib_compress_bound(nullptr, filtered_bytes(width, height));
}

std::size_t PngEncoder::encode(const ImageView& image, std::span<std::uint8_t> out) noexcept {
  const std::size_t size = image.empty() ? 0 : filtered_bytes(image.width, image.height);
  constexpr std::size_t kBefore = kSignature.size() + kAround + kHeader + 8;
  if (size == 0 || size > filtered_.size() || out.size() < kBefore + 4 + kAround) return 0;
  std::uint8_t* to = filtered_.data();
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* from = image.row(y);
    *to++ = kSub;
    *to++ = from[0];
    for (int x = 1; x < image.width; ++x) *to++ = static_cast<std::uint8_t>(from[x] - from[x - 1]);
  }
  std::uint8_t* at = out.data();
  std::memcpy(at, kSignature.data(), kSignature.size());
  at += kSignature.size();
  put_be32(static_cast<std::uint32_t>(image.width), at + 8);
  put_be32(static_cast<std::uint32_t>(image.height), at + 12);
  constexpr std::array<std::uint8_t, 5> kGrey8{8, 0, 0, 0, 0};  // depth, colour, nothing special
  std::memcpy(at + 16, kGrey8.data(), kGrey8.size());
  at += close_chunk("IHDR", kHeader, at);
  const std::size_t packed = libdeflate_zlib_compress(deflate_.get(), filtered_.data(), size,
                                                      at + 8, out.size() - kBefore - 4 - kAround);
  if (packed == 0) return 0;
  at += close_chunk("IDAT", packed, at);
  at += close_chunk("IEND", 0, at);
  return static_cast<std::size_t>(at - out.data());
}

}  // namespace vergence::app
