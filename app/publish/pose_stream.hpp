#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "app/session/records.hpp"
#include "core/calibration/options.hpp"
#include "core/comparison/comparison.hpp"
#include "core/comparison/enu_alignment.hpp"
#include "drivers/ins.hpp"

/// Lines of the pose stream: JSON objects, each with a `type` and followed by a line feed.
/// docs/live_interface.md is their schema.
namespace vergence::app {

inline constexpr int kPoseStreamVersion = 2;

/// Where the odometry's world lies on the earth.
struct PublishedEnuAlignment {
  EnuAlignment alignment{};
  Geodetic origin{};  // of enu

  [[nodiscard]] EnuPose of(const Transform& T_world_left) const;
};

/// `assumed`, `verified`, `contradicted`.
[[nodiscard]] const char* to_word(Pairing pairing) noexcept;

/// `type: pose`. `age_ms`: from mid-exposure to now, where stamps are tied to this machine's clock.
/// `dropped`: frames without a line since the start. Replaces *line, whose memory is used again.
void write_pose_line(const PoseSample& pose, const std::optional<EnuPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line);

/// `type: calibration`, of one that is in use. `names`: of the cameras.
[[nodiscard]] std::string calibration_line(const CalibrationRecord& calibration,
                                           std::span<const std::string> names,
                                           const calibration::CalibrationOptions& options);

/// `type: alignment`.
[[nodiscard]] std::string alignment_line(const PublishedEnuAlignment& alignment);

/// Status of odometry and devices, once per second.
struct StreamStatus {
  struct Ins {
    FixStatus fix = FixStatus::none;
    double silent_s = 0;  // since the last sample
  };

  std::string session{};  // name of the session folder
  std::optional<FrameReport> frame{};
  double silent_s = 0;  // since the last frame
  bool calibrated = false, verified = false, aligned = false;
  std::uint64_t dropped = 0;  // as in a pose line
  std::optional<Ins> ins{};
};
/// `type: status`.
[[nodiscard]] std::string status_line(const StreamStatus& status);

/// `type: image`, in front of the image's pixels, which follow row by row without padding.
[[nodiscard]] std::string image_line(std::uint64_t frame, Stamp stamp, int camera,
                                     std::string_view name, const ImageView& image);

/// `type: response`, to the reader that sent the request.
[[nodiscard]] std::string response_line(std::string_view request, bool accepted,
                                        std::string_view message);

}  // namespace vergence::app
