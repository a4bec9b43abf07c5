#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/recording/recording.hpp"
#include "app/session/frame_source.hpp"

/// What a session's recording is made of: topics, queues, how much may wait. Threads pure.
namespace vergence::app {

/// Queues of a recording, one for each thread that posts.
enum Queue : std::size_t { estimator_queue, acquisition_queue };

/// Topics of a recording. Of a camera there are two, from first_camera_topic on.
enum Topic : std::size_t {
  session_topic,
  frame_topic,
  odometry_topic,
  tf_topic,
  tf_static_topic,
  diagnostics_topic,
  reading_topic,
  fix_topic,
  imu_topic,
  pulse_topic,
  first_camera_topic
};

/// A camera's images; its CameraInfo is the next one.
constexpr std::size_t image_topic(std::size_t camera) noexcept {
  return first_camera_topic + 2 * camera;
}

/// Names of the cameras in topics and as frames of reference: those of the calibration, each once.
[[nodiscard]] std::vector<std::string> recorded_names(const CalibrationFile& file);

[[nodiscard]] Recording::Options recording_options(const Configuration& configuration,
                                                   const SourceFacts& facts);

}  // namespace vergence::app
