#pragma once
#include <functional>

#include "app/checkerboard/board_calibration.hpp"

/// Views of a calibration target from image files.
namespace vergence::app {

/// Files of shell patterns (`left*.jpg`) or file names, combined, ordered by name, without
/// duplicates. Throws InputError if there is none; `option` names the option of the patterns, such
/// as `--left`.
[[nodiscard]] std::vector<std::filesystem::path> matching_files(
    const std::vector<std::string>& patterns, const std::string& option);

/// Turns a list of files per camera into a list of files per view. The order is by the last numbers
/// in the names, ignoring leading zeros, if these identify a camera's files, else by name. If the
/// cameras' numbers differ, views are the common ones; the others are reported in *remarks. Throws
/// InputError for lists of different length without matching numbers.
[[nodiscard]] std::vector<std::vector<std::filesystem::path>> group_views(
    std::vector<std::vector<std::filesystem::path>> cameras, std::vector<std::string>* remarks);

struct BoardImages {
  /// With several cameras, only views of camera 0 and another.
  std::vector<BoardView> views{};
  /// One per camera.
  std::vector<ImageSize> sizes{};
  /// A message for every skipped view.
  std::vector<std::string> remarks{};
};

/// Finds the target in all images. `on_view` (may be empty) is called after every view with the
/// numbers of views done and with the target. Throws InputError if no image can be read, or images
/// of a camera differ in size. An unreadable image gives a remark.
[[nodiscard]] BoardImages read_board_images(
    const std::vector<std::vector<std::filesystem::path>>& views, const BoardPattern& board,
    const std::function<void(std::size_t done, std::size_t found)>& on_view);

}  // namespace vergence::app
