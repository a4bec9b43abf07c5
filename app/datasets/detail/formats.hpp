#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "app/datasets/image_file.hpp"
#include "app/datasets/stereo_sequence.hpp"

/// What the readers of stereo_sequence.hpp share.
namespace vergence::app::detail {

/// Each reader fills root, pairs and, unless `given`, the calibration.
[[nodiscard]] StereoSequence open_kitti(const std::filesystem::path& folder, bool given);
[[nodiscard]] StereoSequence open_euroc(const std::filesystem::path& folder, bool given);
[[nodiscard]] StereoSequence open_folder(const std::filesystem::path& folder, bool given, const CalibrationUse& use);
[[nodiscard]] StereoSequence open_st_lucia(const std::filesystem::path& folder, bool given);

/// Names of the PNG and JPEG files in root/below, sorted, as root-relative paths. InputError: no such folder, no image in it.
[[nodiscard]] std::vector<std::string> list_images(const std::filesystem::path& root, const std::string& below);

/// InputError unless the path is a folder.
void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold);

}  // namespace vergence::app::detail
