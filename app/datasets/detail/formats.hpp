#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
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

[[nodiscard]] StereoSequence open_recorded_session(const std::filesystem::path& folder, bool given);

/// The packets of oxts/ of a KITTI raw drive as INS samples (docs/kitti_raw.md); what is missing,
/// broken or out of order is left out and told. InputError: files that are not there, no packet
/// that is whole, a calibration that is none.
[[nodiscard]] RecordedIns read_oxts(const std::filesystem::path& folder,
                                    const std::array<int, 2>& cameras, bool mount_wanted);

/// Pairs of the nearest stamps, within kMostApart of the interval, in the order of the left ones;
/// images without a partner stand where their stamp belongs. `name`: of an image by camera and
/// index. That stamps differ is one of *assumptions.
[[nodiscard]] std::vector<StereoPair> merged_pairs(
    std::span<const Stamp> left, std::span<const Stamp> right,
    const std::function<std::string(std::size_t camera, std::size_t index)>& name,
    std::vector<std::string>* assumptions);

/// The two folders of a drive that have the usual names of a left and a right camera and images in
/// them, or in `data` or `images` below; as root-relative paths. Nothing: there are none.
[[nodiscard]] std::optional<std::array<std::string, 2>> camera_folders(
    const std::filesystem::path& root);

/// Returns true if open_folder() finds images of two cameras below `root`.
[[nodiscard]] bool holds_stereo_images(const std::filesystem::path& root);

/// By the ending; hidden files, which systems put beside images, are none.
[[nodiscard]] bool is_image_name(const std::string& file);

/// Names of the images in root/below, sorted, as root-relative paths. InputError: no
/// such folder, no image in it that can be read.
[[nodiscard]] std::vector<std::string> list_images(const std::filesystem::path& root,
                                                   const std::string& below);

/// InputError unless the path is a folder.
void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold);

}  // namespace vergence::app::detail
