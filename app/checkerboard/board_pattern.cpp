#include "app/checkerboard/board_pattern.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/ranges.h>

#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

// Limits of the number of inner corners per side.
constexpr int kMin = 3, kMax = 100;
// The family 36h11 has 587 codes.
constexpr int kMaxTagsAlong = 24;
// Limits of the square's side in m.
constexpr double kSmallestSquare = 0.001, kLargest = 10.0;
// Limits of the gap over the side of a tag.
constexpr double kNarrowest = 0.05, kWidest = 2;
// Limits of the marker's side over the side of a square.
constexpr double kSmallestMarker = 0.3, kLargestMarker = 0.95;

/// A board whose size is a text like `9x6`: `parts` of `option`, `least` to `most` along each side.
BoardPattern parse_size(BoardKind kind, const char* option, const char* parts,
                        std::string_view text, int least, int most, const char* example) {
  const auto sides = parse_product(text);
  if (!sides || std::ranges::min(*sides) < least || std::ranges::max(*sides) > most)
    throw InputError("{} is \"{}\"; write the {}, columns x rows, {} to {} each, like {}", option,
                     text.substr(0, 60), parts, least, most, example);
  BoardPattern board{.kind = kind};
  board.columns = static_cast<int>((*sides)[0]), board.rows = static_cast<int>((*sides)[1]);
  return board;
}

std::string upper(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return result;
}

std::size_t parse_dictionary(const std::string& text) {
  constexpr std::string_view kPrefix = "DICT_";
  std::string name = upper(text);
  if (name.starts_with(kPrefix)) name.erase(0, kPrefix.size());
  for (std::size_t i = 0; i < kMarkerDictionaries.size(); ++i)
    if (upper(kMarkerDictionaries[i]) == name) return i;
  throw InputError("--dictionary is \"{}\"; use {}", text.substr(0, 60),
                   fmt::join(kMarkerDictionaries.begin(), kMarkerDictionaries.end(), ", "));
}

void check_side(double square) {
  if (!(square >= kSmallestSquare && square <= kLargest))
    throw InputError("--square is {}; it must be the side of a square in metres, {} to {}", square,
                     kSmallestSquare, kLargest);
}

}  // namespace

std::optional<std::array<std::int64_t, 2>> parse_product(std::string_view text) {
  const std::size_t x = std::min(text.find('x'), text.size());
  const auto first = parse_integer(text.substr(0, x)),
             second = parse_integer(text.substr(std::min(x + 1, text.size())));
  if (!first || !second) return std::nullopt;
  return {{*first, *second}};
}

std::size_t BoardPattern::corners() const noexcept {
  const std::size_t n = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  return kind == BoardKind::aprilgrid ? 4 * n : n;
}

Vec3 BoardPattern::corner(std::size_t i) const noexcept {
  const std::size_t at = kind == BoardKind::aprilgrid ? i / 4 : i;
  const auto n = static_cast<std::size_t>(columns);
  const std::size_t in_column = at % n, in_row = at / n;
  const auto column = static_cast<double>(in_column), row = static_cast<double>(in_row);
  if (kind != BoardKind::aprilgrid) return {square * column, square * row, 0};
  const double pitch = square * (1 + spacing);
  const bool right = i % 4 == 1 || i % 4 == 2, upper = i % 4 >= 2;
  return {pitch * column + (right ? square : 0), pitch * row + (upper ? square : 0), 0};
}

std::string BoardPattern::describe() const {
  if (kind == BoardKind::charuco)
    return fmt::format("{}x{} squares with markers {}", columns + 1, rows + 1,
                       kMarkerDictionaries[dictionary]);
  return fmt::format("{}x{} {}", columns, rows,
                     kind == BoardKind::aprilgrid ? "tags" : "inner corners");
}

BoardPattern parse_checkerboard(const std::string& inner_corners, double square) {
  BoardPattern board = parse_size(BoardKind::checkerboard, "--checkerboard", "inner corners",
                                  inner_corners, kMin, kMax, "9x6");
  if (board.columns == board.rows)
    throw InputError(
        "--checkerboard {}: a square board looks the same after a rotation by 90°; use one with "
        "different numbers of columns and rows",
        inner_corners);
  check_side(square);
  board.square = square;
  return board;
}

BoardPattern parse_aprilgrid(const std::string& tags, double side, double spacing) {
  BoardPattern board =
      parse_size(BoardKind::aprilgrid, "--aprilgrid", "tags", tags, 1, kMaxTagsAlong, "6x6");
  check_side(side);
  if (!(spacing >= kNarrowest && spacing <= kWidest))
    throw InputError(
        "--spacing is {}; it must be the gap between two tags divided by the tag size, {} to {} "
        "(0.3 on Kalibr's sheets)",
        spacing, kNarrowest, kWidest);
  board.square = side;
  board.spacing = spacing;
  return board;
}

BoardPattern parse_charuco(const std::string& squares, double square, double marker,
                           const std::string& dictionary) {
  BoardPattern board =
      parse_size(BoardKind::charuco, "--charuco", "squares", squares, kMin, kMax, "11x8");
  check_side(square);
  if (!(marker >= kSmallestMarker * square && marker <= kLargestMarker * square))
    throw InputError(
        "--marker is {}; it must be the side of a marker in metres, {} to {} with this --square",
        marker, kSmallestMarker * square, kLargestMarker * square);
  // The pattern counts inner corners, not squares.
  --board.columns, --board.rows;
  board.square = square;
  board.marker = marker;
  board.dictionary = parse_dictionary(dictionary);
  return board;
}

}  // namespace vergence::app
