#pragma once
#include <cstddef>

#include "app/report/session.hpp"

namespace vergence::app::report {

/// Reference of the errors on the page.
enum class ErrorSource : std::uint8_t {
  /// There is no reference, so there are no errors.
  none,
  /// Errors of poses.csv, after the ENU alignment.
  ins,
  /// Errors against reference.tum, aligned with the start of the trajectory.
  reference,
};

/// Curves and counts of a session, one value per frame; kNone if there is none.
struct Analysis {
  /// Time since the first frame.
  std::vector<double> time_s;
  /// Distance travelled up to the frame.
  std::vector<double> distance_m;
  /// Not 0 if frames are missing before this one, so that no line is drawn across.
  std::vector<std::uint8_t> breaks;
  /// Median interval between frames; 0 with fewer than two frames.
  double interval_s = 0;
  double duration_s = 0;

  ErrorSource source = ErrorSource::none;
  /// Describes the reference and its alignment.
  std::string source_message;
  /// True if there was an INS, but the trajectory was never aligned with it.
  bool ins_unplaced = false;
  std::vector<double> horizontal_m, vertical_m, heading_deg;
  struct Spread {
    double rms = kNone, max = kNone, end = kNone;
  };
  Spread horizontal, vertical, heading;

  /// As `breaks`, and not 0 where the trajectory was aligned with ENU again: positions step there.
  std::vector<std::uint8_t> map_breaks;
  /// True if the map's axes are east and north.
  bool map_is_enu = false;
  /// In m.
  std::vector<double> estimate_x, estimate_y, reference_x, reference_y;

  /// Numbers of frames.
  std::size_t read = 0, ok = 0, degraded = 0, lost = 0;
  /// Skipped frames; 0 without a summary.
  std::size_t skipped = 0;
  /// Frames that were not ok, indexed by Reason.
  using ByReason = std::array<std::size_t, static_cast<std::size_t>(Reason::pairing_ambiguous) + 1>;
  ByReason by_reason{};
  /// Degraded frames, also counted in by_reason, whose only problem was a calibration not yet found
  /// or verified. They do not affect the assessment.
  std::size_t waited = 0;
  ByReason waited_by_reason{};
  /// Time of the first verification of the calibration in use, since the first frame.
  std::optional<double> verified_s;
  /// Share of the frames read and skipped; none if the status is unknown.
  std::optional<double> ok_share;
  double path_m = 0;

  /// Mean translation error of segments divided by their length.
  std::optional<double> drift;
  /// Describes the segments.
  std::string drift_message;
  /// KITTI segment error of summary.json, if `drift` is another one.
  std::optional<double> segment_error;
  std::optional<double> scale, ate_m, rotation_deg_per_m, end_error;
};

/// Seconds from one stamp to a later one, exact to the nanosecond for days.
[[nodiscard]] double seconds_between(Stamp from, Stamp to) noexcept;

[[nodiscard]] Analysis analyse(const Session& session);

}  // namespace vergence::app::report
