#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/math/types.hpp"

namespace vergence::app {

enum class BoardKind : std::uint8_t {
  checkerboard,
  aprilgrid,  // tags of family 36h11 with a small black square between each four (Kalibr)
  charuco,    // a checkerboard with an ArUco marker in each white square (OpenCV)
};

/// The dictionaries of ArUco markers, as OpenCV names and numbers them (without `DICT_`).
inline constexpr std::array<std::string_view, 21> kMarkerDictionaries = {
    "4X4_50",        "4X4_100",        "4X4_250",       "4X4_1000",      "5X5_50",
    "5X5_100",       "5X5_250",        "5X5_1000",      "6X6_50",        "6X6_100",
    "6X6_250",       "6X6_1000",       "7X7_50",        "7X7_100",       "7X7_250",
    "7X7_1000",      "ARUCO_ORIGINAL", "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h10",
    "APRILTAG_36h11"};

/// A flat board with corners at known places.
///
/// Frame  BoardPattern: corner (row, column) lies at (column, row, 0) · square, metres; seen from
///        its front rows run to the right, z away from the viewer. AprilGrid: as Kalibr has it,
///        origin at the lower left corner of tag 0, x to the right, y up, z to the viewer; corner
///        4 tag + i is the tag's lower left, lower right, upper right, upper left one. ChArUco: as
///        a checkerboard's, of its inner corners.
struct BoardPattern {
  BoardKind kind = BoardKind::checkerboard;
  int columns = 0, rows = 0;   // inner corners; tags
  double square = 0;           // m, side of a square; of a tag's black edge
  double spacing = 0;          // AprilGrid: between two tags, over the side of a tag
  double marker = 0;           // m, ChArUco: side of a marker's black edge
  std::size_t dictionary = 0;  // ChArUco: of kMarkerDictionaries

  [[nodiscard]] std::size_t corners() const noexcept;
  [[nodiscard]] Vec3 corner(std::size_t i) const noexcept;
  /// Turned by half a turn a checkerboard's colours are exchanged: an image alone tells which
  /// corner is the first. Tags always tell.
  [[nodiscard]] bool is_asymmetric() const noexcept {
    return kind != BoardKind::checkerboard || (columns + rows) % 2 == 1;
  }
  /// `9x6 inner corners`, `6x6 tags`, `11x8 squares with markers`.
  [[nodiscard]] std::string describe() const;
};

/// One corner that an image shows.
struct BoardCorner {
  std::size_t index = 0;      // of BoardPattern::corner()
  Vec2 pixel = Vec2::Zero();  // raw image, centres of pixels at integers
};

/// Corners of a target in one image, by index without duplicates; empty if none.
using BoardCorners = std::vector<BoardCorner>;

/// `9x6` and the side of a square in metres. InputError: not two numbers from 3 to 100, as many
/// columns as rows (a quarter turn could not be told), a square that is not between a millimetre
/// and ten metres.
[[nodiscard]] BoardPattern parse_checkerboard(const std::string& inner_corners, double square);

/// `6x6`, the side of a tag in metres and the gap between two of them over that side. InputError:
/// not two numbers from 1 to 24, more tags than the family has (587), a spacing that is not between
/// 0.05 and 2.
[[nodiscard]] BoardPattern parse_aprilgrid(const std::string& tags, double side, double spacing);

/// `11x8` squares, the side of a square and of a marker in metres, and the markers' dictionary, as
/// in kMarkerDictionaries, with or without `DICT_`, in either case. InputError: not two numbers
/// from 3 to 100, a marker that does not fit into its square, a dictionary that there is not.
[[nodiscard]] BoardPattern parse_charuco(const std::string& squares, double square, double marker,
                                         const std::string& dictionary);

}  // namespace vergence::app
