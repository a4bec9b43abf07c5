#include "app/datasets/exif.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace vergence::app {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Numbers of a TIFF block in its own order of bytes; nothing beyond its end.
class Tiff {
 public:
  explicit Tiff(Bytes bytes)
      : bytes_(bytes), big_(bytes.size() > 1 && bytes[0] == 'M' && bytes[1] == 'M') {}

  [[nodiscard]] std::optional<std::uint32_t> number(std::size_t at, std::size_t size) const {
    if (at > bytes_.size() || size > bytes_.size() - at) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8U | bytes_[at + (big_ ? i : size - 1 - i)];
    return value;
  }

 private:
  Bytes bytes_;
  bool big_;
};

std::optional<int> orientation_of(Bytes block) {
  constexpr std::uint32_t kOrientation = 0x0112;
  constexpr std::size_t kEntry = 12, kValue = 8;  // bytes of an entry; where its value begins
  const Tiff tiff(block);
  const auto directory = tiff.number(4, 4);
  const auto entries = directory ? tiff.number(*directory, 2) : std::nullopt;
  if (!entries) return std::nullopt;
  for (std::size_t i = 0; i < *entries; ++i) {
    const std::size_t at = std::size_t{*directory} + 2 + i * kEntry;
    const auto tag = tiff.number(at, 2);
    if (!tag) return std::nullopt;
    if (*tag != kOrientation) continue;
    const auto value = tiff.number(at + kValue, 2);
    return value && *value >= 1 && *value <= 8 ? std::optional(static_cast<int>(*value))
                                               : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> exif_orientation(Bytes jpeg) noexcept {
  constexpr std::uint8_t kMark = 0xff, kStart = 0xd8, kApp1 = 0xe1, kScan = 0xda;
  constexpr std::array<std::uint8_t, 6> kExif{'E', 'x', 'i', 'f', 0, 0};
  if (jpeg.size() < 4 || jpeg[0] != kMark || jpeg[1] != kStart) return std::nullopt;
  for (std::size_t at = 2; at + 4 <= jpeg.size() && jpeg[at] == kMark;) {
    const std::uint8_t kind = jpeg[at + 1];
    const std::size_t length = static_cast<std::size_t>(jpeg[at + 2]) << 8U | jpeg[at + 3];
    if (kind == kScan || length < 2 || length > jpeg.size() - at - 2) return std::nullopt;
    const Bytes body = jpeg.subspan(at + 4, length - 2);
    if (kind == kApp1 && body.size() > kExif.size() &&
        std::equal(kExif.begin(), kExif.end(), body.begin()))
      return orientation_of(body.subspan(kExif.size()));
    at += 2 + length;
  }
  return std::nullopt;
}

}  // namespace vergence::app
