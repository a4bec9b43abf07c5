#pragma once
#include <span>

#include "app/session/records.hpp"
#include "core/calibration/options.hpp"
#include "core/comparison/enu_alignment.hpp"
#include "drivers/ins.hpp"

/// Lines of the pose stream: JSON objects with a `type`, each followed by a line feed. Their schema
/// is in docs/live_interface.md.
namespace vergence::app {

inline constexpr int kPoseStreamVersion = 2;

/// Pose of the odometry's world on the earth.
struct PublishedEnuAlignment {
  EnuAlignment alignment{};
  /// Origin of enu.
  Geodetic origin{};

  [[nodiscard]] EnuPose of(const Transform& T_world_left) const;
};

/// Name such as `assumed`, `verified` or `contradicted`.
[[nodiscard]] const char* pairing_name(Pairing pairing) noexcept;

/// Writes `type: pose`. `age_ms` is the time from mid-exposure to now, if stamps are mapped to this
/// machine's clock. `dropped` is the number of frames without a line since the start. Replaces
/// *line and reuses its memory.
void write_pose_line(const PoseSample& pose, const std::optional<EnuPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line);

/// Line `type: calibration` of the calibration in use. `names` are those of the cameras.
[[nodiscard]] std::string calibration_line(const CalibrationRecord& calibration,
                                           std::span<const std::string> names,
                                           const calibration::CalibrationOptions& options);

/// Line `type: alignment`.
[[nodiscard]] std::string alignment_line(const PublishedEnuAlignment& alignment);

/// Status of odometry and devices, once per second.
struct StreamStatus {
  struct Ins {
    FixStatus fix = FixStatus::none;
    /// Time since the last sample.
    double silent_s = 0;
  };

  /// Name of the session directory.
  std::string session{};
  std::optional<FrameReport> frame{};
  /// Time since the last frame.
  double silent_s = 0;
  bool calibrated = false, verified = false, aligned = false;
  /// Same as in a pose line.
  std::uint64_t dropped = 0;
  std::optional<Ins> ins{};
};
/// Line `type: status`.
[[nodiscard]] std::string status_line(const StreamStatus& status);

/// Line `type: image`, followed by the image's pixels, row by row without padding.
[[nodiscard]] std::string image_line(std::uint64_t frame, Stamp stamp, int camera,
                                     std::string_view name, const ImageView& image);

/// Line `type: response`, to the reader that sent the request.
[[nodiscard]] std::string response_line(std::string_view request, bool accepted,
                                        std::string_view message);

}  // namespace vergence::app
