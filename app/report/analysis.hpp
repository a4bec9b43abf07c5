#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/report/session.hpp"

namespace vergence::app::report {

/// Reference of the errors on the page.
enum class ErrorSource : std::uint8_t {
  none,       // there is no reference: no errors
  ins,        // errors of poses.csv, after the alignment on the earth
  reference,  // reference.tum, the start of the trajectory laid on it
};

/// Curves and counts of a session, one value a frame; kNone where there is none.
struct Analysis {
  std::vector<double> time_s;      // since the first frame
  std::vector<double> distance_m;  // driven up to the frame
  std::vector<std::uint8_t>
      breaks;             // frames are missing before this one: nothing may be drawn across
  double interval_s = 0;  // median between frames; 0: fewer than two
  double duration_s = 0;

  ErrorSource source = ErrorSource::none;
  std::string
      source_message;  // what was compared with what, and how the two were laid on each other
  bool ins_unplaced = false;  // there was an INS, and no frame was placed on the earth with it
  std::vector<double> horizontal_m, vertical_m, heading_deg;
  struct Spread {
    double rms = kNone, max = kNone, end = kNone;
  };
  Spread horizontal, vertical, heading;

  std::vector<double> placed_s;           // when the drive was placed on the earth, each time
  std::vector<std::uint8_t> placed_anew;  // this frame is the first one on a further alignment
  bool map_is_enu = false;                // east to the right, north up
  std::vector<double> ours_x, ours_y, theirs_x, theirs_y;  // m

  std::size_t read = 0, ok = 0, degraded = 0, lost = 0, unknown = 0;  // frames
  std::size_t skipped = 0;             // without a summary those that are missing by their numbers
  std::vector<std::size_t> by_reason;  // frames that were not ok, by Session::reasons
  // Degraded frames, also counted in by_reason, whose only fault was that the run had not yet
  // found or confirmed its calibration. A drive is not judged by that wait.
  std::size_t waited = 0;
  std::vector<std::size_t> waited_by_reason;
  std::optional<double>
      verified_s;  // when the drive first confirmed the calibration in use, since the first frame
  std::optional<double> ok_share;  // of the frames read and skipped; nothing: status is not known
  double path_m = 0;

  std::optional<double> drift;  // ratio: mean translation error of segments over their length
  std::string drift_message;    // which segments
  std::optional<double> segment_error;  // KITTI's, as in summary.json, where `drift` is another
  std::optional<double> scale, ate_m, rotation_deg_per_m, end_error;
};

/// Seconds from one stamp to a later one; exact to the nanosecond for drives of days, whatever the
/// stamps.
[[nodiscard]] double seconds_between(Stamp from, Stamp to) noexcept;

[[nodiscard]] Analysis analyse(const Session& session);

}  // namespace vergence::app::report
