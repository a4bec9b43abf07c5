#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/ins_sample.hpp"
#include "drivers/ins.hpp"

/// ins.csv of a session: every reading of the INS as the device gave it, before any mount is
/// applied.
namespace vergence::app {

/// Columns of a line, in this order. Degrees for places, m and m/s east-north-up, the attitude a
/// Hamilton quaternion from the INS's body (forward, left, up) to east-north-up, sigmas in m, m/s,
/// degrees, `status` the device's own word. Empty where the device told nothing. A position has
/// 1e-10 degrees, 11 µm.
inline constexpr std::string_view kInsHeader =
    "stamp_ns,stamp_error_ns,number,fix,latitude_deg,longitude_deg,height_m,velocity_east,velocity_"
    "north,velocity_up,qx,qy,qz,qw,"
    "position_sigma_m,height_sigma_m,velocity_sigma,tilt_sigma_deg,heading_sigma_deg,status,"
    "satellites,filter_valid,utc_ns";

/// The line with its end into *line. What is not finite, or no place on the earth, is left empty.
void format_ins_record(const InsRecord& record, std::string* line);

/// The file at `path`, or the ins.csv of that folder. Empty: no such file there, or the file is
/// none, told by its first line.
[[nodiscard]] std::filesystem::path find_ins_file(const std::filesystem::path& path);

/// All readings, stamps strictly ascending. A reading that is not later than all before (the
/// device's clock was set back) is passed over, and so is a last line without its end, as a killed
/// session leaves it. InputError with file:line: another head, a line that is none, numbers out of
/// their range; a file without a reading.
[[nodiscard]] std::vector<InsRecord> read_ins_file(const std::filesystem::path& file);

}  // namespace vergence::app
