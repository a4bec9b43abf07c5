#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/datasets/recorded_session.hpp"
#include "app/datasets/trajectory_files.hpp"

namespace vergence::app {

/// Layouts that a recorded session is written in for other programs.
enum class ExportFormat : std::uint8_t { folder, euroc, kitti };

struct ExportRequest {
  ExportFormat format = ExportFormat::folder;
  std::filesystem::path out;    // is empty, or is made
  CalibrationFile calibration;  // that goes with the images
  Trajectory truth;             // of the left camera; empty: none
};

struct ExportResult {
  std::size_t frames = 0;
  std::size_t left_out = 0;            // without a left or right image that reads back
  std::vector<std::string> remarks{};  // messages
};

/// Left and right images as PNG, stamps, calibration and truth:
///   folder  left/, right/NNNNNN.png, times.txt (ns), calibration.yaml, truth.tum
///   euroc   mav0/cam0, cam1 with data.csv and sensor.yaml, truth in
///           mav0/state_groundtruth_estimate0 (positions and attitudes of cam0)
///   kitti   image_0, image_1, times.txt, calib.txt; poses.txt where there is truth for every
///   frame.
///           KITTI has rectified images: lenses with distortion and turned cameras are refused.
/// A frame up to 1 ms beyond the truth's end has its motion carried on.
/// The first two cameras of a rig with more. `progress` is called with the frames done.
/// InputError: a disk that takes no more; before anything is written, a calibration of images of
/// another size, a rig that the format cannot hold, no pair at all.
ExportResult export_session(const RecordedSession& session, ExportRequest request,
                            const std::function<void(std::size_t)>& progress);

}  // namespace vergence::app
