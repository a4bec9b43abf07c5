#include "app/datasets/sequence_format.hpp"

#include <system_error>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {

SequenceFormat sequence_format(const std::string& word, const std::filesystem::path& folder) {
  constexpr const char* kLayouts =
      "KITTI (image_0, image_1, calib.txt, times.txt), KITTI raw (image_00, image_01, calib_*.txt "
      "above), EuRoC (mav0), plain (left, "
      "right, times.txt, calibration.yaml), UQ St Lucia and ROS 2 bags (.mcap) are what can be "
      "read";
  if (word == "kitti") return SequenceFormat::kitti;
  if (word == "kitti-raw") return SequenceFormat::kitti_raw;
  if (word == "euroc") return SequenceFormat::euroc;
  if (word == "folder") return SequenceFormat::folder;
  if (word == "st-lucia") return SequenceFormat::st_lucia;
  if (word == "mcap") return SequenceFormat::mcap;
  if (word == "session")
    throw InputError(
        "--format session is not there yet in this version; kitti, kitti-raw, euroc, folder, "
        "st-lucia and mcap are");
  if (word != "auto")
    throw InputError("--format \"" + word + "\" is not known" +
                     did_you_mean(word, {"auto", "kitti", "kitti-raw", "euroc", "folder",
                                         "st-lucia", "mcap", "session"}) +
                     "; kitti, kitti-raw, euroc, folder, st-lucia and mcap are what can be read, "
                     "and auto finds out which it is");
  std::error_code ignored;
  if (folder.extension() == ".mcap") return SequenceFormat::mcap;
  if (!std::filesystem::is_directory(folder, ignored))
    throw InputError(folder.string() + ": is no folder; a folder with a drive is expected");
  if (const auto found = find_format(folder)) return *found;
  throw InputError(folder.string() + ": holds no drive that is known: " + kLayouts);
}

}  // namespace vergence::app
