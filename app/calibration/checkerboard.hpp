#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/math/types.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// A checkerboard by its inner corners.
///
/// Frame  Corner (row, col) lies at (col, row, 0) · square, metres; seen from its front the rows
///        run to the right, z away from the viewer.
struct Checkerboard {
  int columns = 0, rows = 0;  // inner corners
  double square = 0;          // m

  [[nodiscard]] std::size_t corners() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  [[nodiscard]] Vec3 corner(std::size_t i) const noexcept {
    const auto n = static_cast<std::size_t>(columns);
    const std::size_t row = i / n, column = i % n;
    return {square * static_cast<double>(column), square * static_cast<double>(row), 0};
  }
  /// Turned by half a turn the colours are exchanged: an image alone tells which corner is the
  /// first.
  [[nodiscard]] bool tells_its_ends() const noexcept { return (columns + rows) % 2 == 1; }
};

/// `9x6` and the side of a square in metres. InputError: not two numbers from 3 to 100, as many
/// columns as rows (a quarter turn could not be told), a square that is not between a millimetre
/// and ten metres.
[[nodiscard]] Checkerboard parse_checkerboard(const std::string& inner_corners, double square);

enum class BoardSearch : std::uint8_t {
  thorough,  // images from files
  quick,     // live: gives up soon where no board is
};

/// The corners of the board in an image to about a tenth of a pixel, row by row, in the order of
/// Checkerboard::corner(); pixel centres at integers. The corner from which the rows run to the
/// right and down is found by the squares' colours where they tell, else it is the detector's
/// choice: see same_way_up(). Nothing: not all of them are there.
///
/// OpenCV's findChessboardCorners and cornerSubPix with a window that fits the smallest square
/// seen: a wider one reaches over the next corner.
[[nodiscard]] std::optional<std::vector<Vec2>> find_checkerboard(const ImageView& image,
                                                                 const Checkerboard& board,
                                                                 BoardSearch search);

/// Turns a board that does not tell its ends so that its diagonal runs as it does in another camera
/// of the rig, which is mounted the same way up.
void same_way_up(const std::vector<Vec2>& reference, std::vector<Vec2>* corners);

}  // namespace vergence::app
