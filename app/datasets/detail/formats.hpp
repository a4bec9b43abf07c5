#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "core/math/se3.hpp"

/// What the readers of stereo_sequence.hpp share.
namespace vergence::app::detail {

/// Each reader fills root, pairs and, unless `given`, the calibration.
[[nodiscard]] StereoSequence open_kitti(const std::filesystem::path& folder, bool given);
/// `cameras`: left and right, of 00 to 03.
[[nodiscard]] StereoSequence open_kitti_raw(const std::filesystem::path& folder, bool given,
                                            const std::array<int, 2>& cameras);
[[nodiscard]] StereoSequence open_euroc(const std::filesystem::path& folder, bool given);
[[nodiscard]] StereoSequence open_folder(const std::filesystem::path& folder, bool given,
                                         const CalibrationUse& use);
[[nodiscard]] StereoSequence open_st_lucia(const std::filesystem::path& folder, bool given);
[[nodiscard]] StereoSequence open_bag(BagFormat format, const std::filesystem::path& bag,
                                      bool given, const BagTopics& topics);
/// The same of a bag whose index is there; `path`: for sentences.
[[nodiscard]] StereoSequence sequence_of(const std::filesystem::path& path, BagIndex bag,
                                         bool given, const BagTopics& topics);

/// The packets of oxts/ of a KITTI raw drive as INS samples (docs/kitti_raw.md); what is missing,
/// broken or out of order is left out and told. InputError: files that are not there, no packet
/// that is whole, a calibration that is none.
[[nodiscard]] RecordedIns read_oxts(const std::filesystem::path& folder,
                                    const std::array<int, 2>& cameras, bool mount_wanted);

/// The camera that a rectified projection P = K [I | t] (3×4 row by row, pixels and metres)
/// describes, without its image's size, and where it sits: X_k = X_rectified + *t. InputError with
/// file:line: it is no such projection.
[[nodiscard]] Intrinsics rectified_camera(const std::array<double, 12>& P, Vec3* t,
                                          const std::filesystem::path& file, std::size_t line);

/// Names of the PNG and JPEG files in root/below, sorted, as root-relative paths. InputError: no
/// such folder, no image in it.
[[nodiscard]] std::vector<std::string> list_images(const std::filesystem::path& root,
                                                   const std::string& below);

/// InputError unless the path is a folder.
void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold);

}  // namespace vergence::app::detail
