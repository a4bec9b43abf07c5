#pragma once
#include <array>
#include <filesystem>
#include <optional>

#include "app/datasets/image_file.hpp"
#include "core/math/se3.hpp"
#include "core/types/calibration.hpp"

/// KITTI's calib.txt and calib_*.txt: lines `KEY: numbers`; copies of them may lack the colon.
/// Layout and units are those of the development kits (Geiger, Lenz, Stiller, Urtasun, "Vision
/// meets robotics: The KITTI dataset", IJRR 2013). InputError with file:line: no such file or key,
/// another count, no numbers, no rotation, no size, no projection of a rectified camera.
namespace vergence::app {

/// A rotation as a file gives it: R Rᵀ is off the identity by up to 1e-4 in an element, and it is
/// no reflection.
[[nodiscard]] bool accept_rotation(const Mat3& written) noexcept;

/// The rig of two rectified cameras by their projections, `P0` or `P_rect_00`. Its images have the
/// size `S_rect_00` where the file says one, else `size`; InputError: there is none.
[[nodiscard]] RigCalibration read_kitti_projections(const std::filesystem::path& file,
                                                    const std::array<int, 2>& cameras,
                                                    const std::optional<ImageSize>& size);

inline constexpr const char* kKittiRawCalibration = "calib_cam_to_cam.txt";

struct KittiRawFolders {
  std::filesystem::path drive{};        // holds image_NN and oxts
  std::filesystem::path calibration{};  // holds calib_*.txt: the drive's date, or the drive itself
};

/// The rig of two of the four cameras of a KITTI raw drive, and where it sits.
struct KittiRawRig {
  RigCalibration rig{};
  Transform T_left_camera0{};  // p_left = T · p_camera0, of the camera 00 before rectification
};

/// From calib_cam_to_cam.txt: `images` is the size that the images have, by which they are raw
/// (S_NN) or rectified (S_rect_NN); where both are that size, the name of a drive that ends in
/// _sync says rectified.
[[nodiscard]] KittiRawRig read_kitti_raw_rig(const KittiRawFolders& folders,
                                             const std::array<int, 2>& cameras, ImageSize images);

/// p_camera0 = T · p_ins from calib_velo_to_cam.txt and calib_imu_to_velo.txt.
[[nodiscard]] Transform read_kitti_raw_mount(const KittiRawFolders& folders);

}  // namespace vergence::app
