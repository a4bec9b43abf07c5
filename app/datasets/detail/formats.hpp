#pragma once

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/stereo_sequence.hpp"

/// Shared parts of the readers of stereo_sequence.hpp.
namespace vergence::app::detail {

/// Each reader fills root, pairs and, unless `given`, the calibration.
[[nodiscard]] StereoSequence open_kitti(const std::filesystem::path& folder, bool given);
/// `cameras` are left and right, of 00 to 03.
[[nodiscard]] StereoSequence open_kitti_raw(const std::filesystem::path& folder, bool given,
                                            const std::array<int, 2>& cameras);
[[nodiscard]] StereoSequence open_euroc(const std::filesystem::path& folder, bool given,
                                        const CalibrationUse& use);
[[nodiscard]] StereoSequence open_folder(const std::filesystem::path& folder, bool given,
                                         const CalibrationUse& use);
[[nodiscard]] StereoSequence open_st_lucia(const std::filesystem::path& folder, bool given);
[[nodiscard]] StereoSequence open_bag(BagFormat format, const std::filesystem::path& bag,
                                      bool given, const BagTopics& topics);
/// Opens a sequence of an indexed bag; `path` is for messages.
[[nodiscard]] StereoSequence make_sequence(const std::filesystem::path& path, BagIndex bag,
                                           bool given, const BagTopics& topics);

/// Reads the packets of oxts/ of a KITTI raw drive as INS samples (docs/datasets.md); missing,
/// damaged or disordered ones are skipped and reported. Throws InputError for missing files, no
/// complete packet, or an invalid calibration.
[[nodiscard]] RecordedIns read_oxts(const std::filesystem::path& folder,
                                    const std::array<int, 2>& cameras, bool mount_wanted);

/// Returns true if open_folder() finds images of two cameras below `root`.
[[nodiscard]] bool holds_stereo_images(const std::filesystem::path& root);

/// Reads the INS log in a St Lucia directory (docs/datasets.md). Lines without twelve numbers are
/// skipped and counted, like samples whose stamps do not increase; the log has no sigmas. Axes that
/// the drive cannot determine (never fast or steep enough) are the MTi-G's: x forward, y left, z
/// up, yaw from north counter-clockwise. Without a log there are no samples, with a remark. Throws
/// InputError for several logs, more than 1 % damaged lines, or invalid positions.
[[nodiscard]] RecordedIns read_st_lucia_ins(const std::filesystem::path& folder);

/// True if `folder`, its date's directory or one above contains a drive. Throws InputError if
/// unreadable.
[[nodiscard]] bool holds_kitti_raw(const std::filesystem::path& folder);
/// `folder` is the drive, its date, or the date's parent. Throws InputError for no or several
/// drives.
[[nodiscard]] KittiRawFolders find_kitti_raw(const std::filesystem::path& folder);

/// Throws InputError unless the path is a directory.
void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold);

}  // namespace vergence::app::detail
