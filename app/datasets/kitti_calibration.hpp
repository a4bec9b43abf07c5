#pragma once
#include <optional>

#include "app/datasets/image_file.hpp"
#include "core/types/calibration.hpp"

/// KITTI's calib.txt and calib_*.txt: lines `KEY: numbers`; some copies lack the colon. Layout and
/// units follow the development kits (Geiger, Lenz, Stiller, Urtasun, "Vision meets robotics: The
/// KITTI dataset", IJRR 2013). Throws InputError with file:line for missing, malformed or
/// inconsistent content.
namespace vergence::app {

/// True if a rotation from a file is proper: R Rᵀ differs from the identity by at most 1e-4 per
/// element, and it is no reflection.
[[nodiscard]] bool accept_rotation(const Mat3& written) noexcept;

/// Rig of two rectified cameras from their projections `P0` or `P_rect_00`. The image size is the
/// file's `S_rect_00`, else `size`; throws InputError if there is none.
[[nodiscard]] RigCalibration read_kitti_projections(const std::filesystem::path& file,
                                                    const std::array<int, 2>& cameras,
                                                    const std::optional<ImageSize>& size);

inline constexpr const char* kKittiRawCalibration = "calib_cam_to_cam.txt";

struct KittiRawFolders {
  /// Contains image_NN and oxts.
  std::filesystem::path drive{};
  /// Contains calib_*.txt: the date's directory, or the drive's.
  std::filesystem::path calibration{};
};

/// Rig of two of the four cameras of a KITTI raw drive, and its transform to camera 00.
struct KittiRawRig {
  RigCalibration rig{};
  /// Transform p_left = T · p_camera0 to camera 00 before rectification.
  Transform T_left_camera0{};
};

/// Reads calib_cam_to_cam.txt. `images` is the size of the images, which tells raw (S_NN) from
/// rectified (S_rect_NN); if both match, a drive's name that ends in _sync means rectified.
[[nodiscard]] KittiRawRig read_kitti_raw_rig(const KittiRawFolders& folders,
                                             const std::array<int, 2>& cameras, ImageSize images);

/// Transform p_camera0 = T · p_ins from calib_velo_to_cam.txt and calib_imu_to_velo.txt.
[[nodiscard]] Transform read_kitti_raw_mount(const KittiRawFolders& folders);

}  // namespace vergence::app
