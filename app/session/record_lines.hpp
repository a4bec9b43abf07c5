#pragma once
#include <string>

#include "app/session/records.hpp"

namespace vergence::app {

/// What poses.csv has, in this order (DESIGN §6).
inline constexpr const char* kPosesHeader =
    "frame,stamp_ns,state,status,reason,x,y,z,qx,qy,qz,qw,east,north,up,latitude_deg,longitude_deg,"
    "height_m,heading_deg,"
    "ins_east,ins_north,ins_up,ins_latitude_deg,ins_longitude_deg,ins_height_m,ins_heading_deg,"
    "error_east_m,error_north_m,error_up_m,error_heading_deg,inliers,reprojection_px,estimate_ms";
/// The line of poses.csv, its end included, in place of what `line` has.
void format_frame(const FrameReport& report, std::string* line);
/// The same of a TUM file: the stamp in seconds, position, quaternion.
void format_tum(Stamp stamp, const Transform& T, std::string* line);

/// The line of calibrations.csv (kCalibrationsHeader) of camera k, 1 ≤ k < cameras, end of line
/// included.
///
/// Memory  None where the capacity of *line is enough.
void format_calibration(const CalibrationRecord& calibration, int k, std::string* line);

/// A line of events.jsonl, end of line included: `stamp_ns`, `kind`, `sentence`, `fields`. Bytes
/// that are no UTF-8, which file names may hold, become U+FFFD: the line stays JSON.
///
/// Memory  None where the capacity of *line is enough.
void format_event(const EventRecord& event, std::string* line);

}  // namespace vergence::app
