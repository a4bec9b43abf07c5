#pragma once
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/datasets/image_file.hpp"
#include "core/math/se3.hpp"
#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

/// What the readers of a KITTI raw drive share: where its files lie, its stamps, its calibration.
/// Layout and units are those of the raw data's development kit (Geiger, Lenz, Stiller, Urtasun,
/// "Vision meets robotics: The KITTI dataset", IJRR 2013).
namespace vergence::app::detail {

struct KittiRawFolders {
  std::filesystem::path drive{};        // holds image_NN and oxts
  std::filesystem::path calibration{};  // holds calib_*.txt: the drive's date, or the drive itself
};

/// A drive lies in `folder`, in its date's folder or one above. InputError: it cannot be listed.
[[nodiscard]] bool holds_kitti_raw(const std::filesystem::path& folder);

/// `folder`: the drive, its date, or what the date lies in. InputError: no drive in it, or several.
[[nodiscard]] KittiRawFolders find_kitti_raw(const std::filesystem::path& folder);

/// A timestamps.txt: line k is of file k.
struct KittiStamps {
  std::vector<std::optional<Stamp>> lines{};  // nothing: the line is empty or no stamp
  std::size_t broken = 0;                     // of these
  std::size_t first_broken = 0;               // its number in the file, from 1
};

/// A last line without its end that has fewer decimals than the one before counts as broken: it was
/// cut off.
/// InputError: not there, no stamp in it, more lines than kMostReadings.
[[nodiscard]] KittiStamps read_kitti_stamps(const std::filesystem::path& file);

/// The rig of two of the four cameras, and where it sits.
struct KittiRawRig {
  RigCalibration rig{};
  bool rectified = false;      // the images are; else they are as the lenses made them
  Transform T_left_camera0{};  // p_left = T · p_camera0, of the camera 00 before rectification
};

/// From calib_cam_to_cam.txt: `images` is the size that the images have, by which they are raw
/// (S_NN) or rectified (S_rect_NN); where both are that size, `drive_name` that ends in _sync says
/// rectified. InputError with file:line.
[[nodiscard]] KittiRawRig read_kitti_raw_rig(const std::filesystem::path& file,
                                             const std::array<int, 2>& cameras, ImageSize images,
                                             const std::string& drive_name);

/// p_camera0 = T · p_ins from calib_velo_to_cam.txt and calib_imu_to_velo.txt. InputError with
/// file:line.
[[nodiscard]] Transform read_kitti_raw_mount(const std::filesystem::path& folder);

/// The images of camera `camera` of the drive, image_NN.
[[nodiscard]] std::string kitti_raw_camera(int camera);

}  // namespace vergence::app::detail
