#pragma once
#include <array>
#include <filesystem>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/stereo_sequence.hpp"

/// Shared parts of the readers of stereo_sequence.hpp.
namespace vergence::app::detail {

/// Each reader fills root, pairs and, unless `given`, the calibration.
[[nodiscard]] StereoSequence open_kitti(const std::filesystem::path& folder, bool given);
/// `cameras`: left and right, of 00 to 03.
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
[[nodiscard]] StereoSequence sequence_of(const std::filesystem::path& path, BagIndex bag,
                                         bool given, const BagTopics& topics);

/// The packets of oxts/ of a KITTI raw drive as INS samples (docs/datasets.md); what is missing,
/// broken or out of order is left out and told. InputError: files that are not there, no packet
/// that is whole, a calibration that is none.
[[nodiscard]] RecordedIns read_oxts(const std::filesystem::path& folder,
                                    const std::array<int, 2>& cameras, bool mount_wanted);

/// Returns true if open_folder() finds images of two cameras below `root`.
[[nodiscard]] bool holds_stereo_images(const std::filesystem::path& root);

/// The log of the INS in a St Lucia folder (docs/datasets.md). Lines that are no twelve numbers are
/// left out and counted, readings sorted by their stamps; without sigmas, the log has none. What
/// the drive cannot tell of its axes (it never is fast or steep enough) is the MTi-G's own: x
/// forward, y left, z up, yaw from north counter-clockwise. Without a log there are no readings,
/// and a remark. InputError: several logs, more than one line in a hundred broken, positions that
/// are no places.
[[nodiscard]] RecordedIns read_st_lucia_ins(const std::filesystem::path& folder);

/// A drive lies in `folder`, in its date's folder or one above. InputError: it cannot be listed.
[[nodiscard]] bool holds_kitti_raw(const std::filesystem::path& folder);
/// `folder`: the drive, its date, or what the date lies in. InputError: no drive in it, or several.
[[nodiscard]] KittiRawFolders find_kitti_raw(const std::filesystem::path& folder);

/// InputError unless the path is a folder.
void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold);

}  // namespace vergence::app::detail
