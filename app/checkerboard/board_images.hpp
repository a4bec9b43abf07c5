#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/checkerboard/board_calibration.hpp"
#include "app/datasets/image_file.hpp"

/// Views of a checkerboard from image files.
namespace vergence::app {

/// Files that a shell's pattern names (`left*.jpg`), or the file itself; several are put together.
/// In order of name, none twice.
/// InputError: there is none. `option` names whose patterns they are: `--left`.
[[nodiscard]] std::vector<std::filesystem::path> matching_files(
    const std::vector<std::string>& patterns, const std::string& option);

/// One list of files a camera → one list of files a view, in order of the last numbers in the names
/// where these tell a camera's files apart, else of the names. Numbers are equal whatever zeros are
/// in front. Where not every camera has the same ones, views are those that all have; the others
/// are said in *remarks.
/// InputError: lists of different length that numbers do not put together.
[[nodiscard]] std::vector<std::vector<std::filesystem::path>> group_views(
    const std::vector<std::vector<std::filesystem::path>>& cameras,
    std::vector<std::string>* remarks);

struct BoardImages {
  std::vector<BoardView> views{};      // of several cameras: those that camera 0 and another have
  std::vector<ImageSize> sizes{};      // one a camera
  std::vector<std::string> remarks{};  // a message for every view that is skipped
};

/// Finds the board in all of them. `on_view` (may be empty) is called after every view: how many
/// are done, how many of them have the board. InputError: no image can be read, or images of one
/// camera differ in size. An image that cannot be read is a remark.
[[nodiscard]] BoardImages read_board_images(
    const std::vector<std::vector<std::filesystem::path>>& views, const BoardPattern& board,
    const std::function<void(std::size_t done, std::size_t found)>& on_view);

}  // namespace vergence::app
