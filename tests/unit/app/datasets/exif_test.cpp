#include "app/datasets/exif.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/math/random.hpp"

namespace vergence::app {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A JPEG's beginning with an EXIF block of two entries, written by hand from the standards'
/// tables.
Bytes jpeg_with(std::uint8_t orientation, bool big) {
  const auto two = [big](std::uint8_t v) { return big ? Bytes{0, v} : Bytes{v, 0}; };
  const auto four = [big](std::uint8_t v) { return big ? Bytes{0, 0, 0, v} : Bytes{v, 0, 0, 0}; };
  Bytes tiff = big ? Bytes{'M', 'M', 0, 42} : Bytes{'I', 'I', 42, 0};
  const auto add = [&tiff](const Bytes& more) {
    for (const std::uint8_t byte : more) tiff.push_back(byte);
  };
  add(four(8));  // the first directory
  add(two(2));
  add(big ? Bytes{0x01, 0x00} : Bytes{0x00, 0x01});  // width, which is passed over
  add(two(3)), add(four(1)), add(two(64)), add(two(0));
  add(big ? Bytes{0x01, 0x12} : Bytes{0x12, 0x01});
  add(two(3)), add(four(1)), add(two(orientation)), add(two(0));
  Bytes jpeg{0xff, 0xd8, 0xff, 0xe0, 0, 4,
             0,    0,    0xff, 0xe1, 0, static_cast<std::uint8_t>(8 + tiff.size()),
             'E',  'x',  'i',  'f',  0, 0};
  for (const std::uint8_t byte : tiff) jpeg.push_back(byte);
  for (const int byte : {0xff, 0xda, 0, 2}) jpeg.push_back(static_cast<std::uint8_t>(byte));
  return jpeg;
}

TEST(Exif, theOrientationIsReadInBothOrdersOfBytes) {
  EXPECT_EQ(exif_orientation(jpeg_with(6, false)), 6);
  EXPECT_EQ(exif_orientation(jpeg_with(3, true)), 3);
  EXPECT_EQ(exif_orientation(jpeg_with(9, true)), std::nullopt);
  EXPECT_EQ(exif_orientation(Bytes{0xff, 0xd8, 0xff, 0xda, 0, 2}), std::nullopt);
  EXPECT_EQ(exif_orientation({}), std::nullopt);
}

TEST(Exif, noBytesLeadBeyondTheirEnd) {
  Random random(5);
  for (int i = 0; i < 20000; ++i) {
    Bytes jpeg = jpeg_with(6, i % 2 == 0);
    for (int k = 0; k < 3; ++k)
      jpeg[static_cast<std::size_t>(random.uniform() * static_cast<double>(jpeg.size()))] =
          static_cast<std::uint8_t>(256 * random.uniform());
    jpeg.resize(static_cast<std::size_t>(random.uniform() * static_cast<double>(jpeg.size() + 1)));
    jpeg.shrink_to_fit();
    const auto orientation = exif_orientation(jpeg);
    EXPECT_TRUE(!orientation || (*orientation >= 1 && *orientation <= 8));
  }
}

}  // namespace
}  // namespace vergence::app
