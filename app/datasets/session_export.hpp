#pragma once
#include "app/datasets/recorded_session.hpp"
#include "app/datasets/trajectory_files.hpp"

namespace vergence::app {

/// Layouts for exporting a recorded session to other programs.
enum class ExportFormat : std::uint8_t { folder, euroc, kitti };

struct ExportRequest {
  ExportFormat format = ExportFormat::folder;
  /// Must be empty or not exist.
  std::filesystem::path out;
  /// Calibration of the images.
  CalibrationFile calibration;
  /// Trajectory of the left camera; empty without ground truth.
  Trajectory truth;
};

struct ExportResult {
  std::size_t frames = 0;
  /// Number of frames without a readable left or right image.
  std::size_t left_out = 0;
  /// Messages.
  std::vector<std::string> remarks{};
};

/// Writes left and right images as PNG, stamps, calibration and ground truth:
///   folder  left/, right/NNNNNN.png, times.txt (ns), calibration.yaml, truth.tum
///   euroc   mav0/cam0, cam1 with data.csv and sensor.yaml, ground truth in
///           mav0/state_groundtruth_estimate0 (positions and attitudes of cam0)
///   kitti   image_0, image_1, times.txt, calib.txt and poses.txt: with ground truth, only frames
///           that have it.
///           KITTI has rectified images: distortion and rotated cameras are refused.
///
/// Only the first two cameras are exported. `progress` is called with the number of frames done.
/// Throws InputError if the disk refuses data and, before writing, for a calibration of another
/// image size, a rig that the format cannot hold, or without a pair.
ExportResult export_session(const RecordedSession& session, ExportRequest request,
                            const std::function<void(std::size_t)>& progress);

}  // namespace vergence::app
