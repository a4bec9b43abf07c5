#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/math/types.hpp"

namespace vergence::app {

enum class BoardKind : std::uint8_t {
  checkerboard,
  /// Tags of family 36h11 with a small black square between each four (Kalibr).
  aprilgrid,
  /// Checkerboard with an ArUco marker in each white square (OpenCV).
  charuco,
};

/// Dictionaries of ArUco markers with OpenCV's names and numbers (without `DICT_`).
inline constexpr std::array<std::string_view, 21> kMarkerDictionaries = {
    "4X4_50",        "4X4_100",        "4X4_250",       "4X4_1000",      "5X5_50",
    "5X5_100",       "5X5_250",        "5X5_1000",      "6X6_50",        "6X6_100",
    "6X6_250",       "6X6_1000",       "7X7_50",        "7X7_100",       "7X7_250",
    "7X7_1000",      "ARUCO_ORIGINAL", "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h10",
    "APRILTAG_36h11"};

/// Flat calibration target with known corners.
///
/// Frame  Corner (row, column) of a checkerboard is at (column, row, 0) · square, in metres; seen
///        from the front rows run to the right, z away from the viewer. AprilGrid as in Kalibr:
///        origin at the lower left corner of tag 0, x to the right, y up, z to the viewer; corner 4
///        tag + i is the tag's lower left, lower right, upper right, upper left one. ChArUco: as a
///        checkerboard of its inner corners.
struct BoardPattern {
  BoardKind kind = BoardKind::checkerboard;
  /// Numbers of inner corners, or of tags.
  int columns = 0, rows = 0;
  /// Side of a square, or of a tag's black edge, in m.
  double square = 0;
  /// AprilGrid: gap between two tags over the side of a tag.
  double spacing = 0;
  /// ChArUco: side of a marker's black edge, in m.
  double marker = 0;
  /// ChArUco: index in kMarkerDictionaries.
  std::size_t dictionary = 0;

  [[nodiscard]] std::size_t corners() const noexcept;
  [[nodiscard]] Vec3 corner(std::size_t i) const noexcept;
  /// True if one image identifies the first corner: a rotation by 180° swaps the colours of such a
  /// checkerboard. Always true for tags.
  [[nodiscard]] bool is_asymmetric() const noexcept {
    return kind != BoardKind::checkerboard || (columns + rows) % 2 == 1;
  }
  /// Text such as `9x6 inner corners`, `6x6 tags` or `11x8 squares with markers`.
  [[nodiscard]] std::string describe() const;
};

/// Visible corner in an image.
struct BoardCorner {
  /// Index for BoardPattern::corner().
  std::size_t index = 0;
  /// Pixel in the raw image, with pixel centres at integers.
  Vec2 pixel = Vec2::Zero();
};

/// Corners of a target in one image, by index without duplicates; empty if none.
using BoardCorners = std::vector<BoardCorner>;

/// Parses two whole numbers such as `9x6`; empty if the text is another.
[[nodiscard]] std::optional<std::array<std::int64_t, 2>> parse_product(std::string_view text);

/// Parses inner corners such as `9x6`; `square` is the side of a square in metres. Throws
/// InputError unless these are two numbers from 3 to 100, not equal (a rotation by 90° would be
/// ambiguous), and the side is between 1 mm and 10 m.
[[nodiscard]] BoardPattern parse_checkerboard(const std::string& inner_corners, double square);

/// Parses tags such as `6x6`; `side` is that of a tag in metres, `spacing` the gap over the side.
/// Throws InputError unless these are two numbers from 1 to 24, with at most the family's 587 tags,
/// and a spacing between 0.05 and 2.
[[nodiscard]] BoardPattern parse_aprilgrid(const std::string& tags, double side, double spacing);

/// Parses squares such as `11x8`, with the sides of a square and of a marker in metres and the
/// dictionary as in kMarkerDictionaries, with or without `DICT_`, case-insensitive. Throws
/// InputError unless these are two numbers from 3 to 100, a marker smaller than its square, and a
/// known dictionary.
[[nodiscard]] BoardPattern parse_charuco(const std::string& squares, double square, double marker,
                                         const std::string& dictionary);

}  // namespace vergence::app
