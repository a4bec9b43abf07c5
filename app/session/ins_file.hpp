#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/ins_sample.hpp"
#include "drivers/ins.hpp"

/// File ins.csv of a session: every INS sample as sent by the device, before extrinsics are
/// applied.
namespace vergence::app {

/// Columns of a line: positions in degrees, m and m/s east-north-up, attitude as Hamilton
/// quaternion from the INS's body (forward, left, up) to east-north-up, sigmas in m, m/s and
/// degrees, `status` as the device's status word. Missing values are empty. Positions have 1e-10
/// degrees (11 µm).
inline constexpr std::string_view kInsHeader =
    "stamp_ns,stamp_error_ns,number,fix,latitude_deg,longitude_deg,height_m,velocity_east,velocity_"
    "north,velocity_up,qx,qy,qz,qw,position_sigma_m,height_sigma_m,velocity_sigma,tilt_sigma_deg,"
    "heading_sigma_deg,status,satellites,filter_valid,utc_ns";

/// Formats the line with its end into *line. Non-finite values and invalid positions are left
/// empty.
void format_ins_record(const InsRecord& record, std::string* line);

/// The file at `path`, or ins.csv in that directory. Empty if there is none, or its first line is
/// another.
[[nodiscard]] std::filesystem::path find_ins_file(const std::filesystem::path& path);

/// All samples with strictly increasing stamps. Skips samples that are not later than all before
/// (the device's clock was set back) and an incomplete last line of a killed session. Throws
/// InputError with file:line for another header, an invalid line, values out of range, or a file
/// without samples.
[[nodiscard]] std::vector<InsRecord> read_ins_file(const std::filesystem::path& file);

}  // namespace vergence::app
