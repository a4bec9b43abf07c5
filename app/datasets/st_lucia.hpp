#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/types/ins_sample.hpp"

/// The INS of the UQ St Lucia stereo vehicular data set (Warren et al. 2010); its images come
/// through open_sequence().
///
/// `PREFIX_Ins0.log` has twelve fields a line: seconds, microseconds (not padded), latitude and
/// longitude in degrees, height above the ellipsoid and above the sea, velocity along three axes,
/// roll, pitch and yaw in radians. Nobody says which axes these are, so they are decided from the
/// drive: an axis that fits how the position moves is that axis.
namespace vergence::app {

struct StLuciaConventions {
  enum class Velocity {
    east_north_up,
    north_east_down,
    north_west_up
  } velocity = Velocity::north_west_up;
  enum class Yaw {
    north_to_west,
    north_to_east,
    east_to_north
  } yaw = Yaw::north_to_west;  // where 0 points, and which way it grows
  bool pitch_first = false;    // fields 10 and 11 are pitch and roll
  bool nose_up_positive = false;
};

struct StLuciaIns {
  std::vector<InsSample> samples;  // stamps strictly ascending; no sigmas: the log has none
  StLuciaConventions conventions;
  std::vector<std::string>
      remarks;  // what was found out, left out or taken on trust: a sentence each
};

/// The log of the drive in `folder` (the one that holds `PREFIX_Ins0.log`). Lines that are no
/// twelve numbers are left out and counted, samples are sorted by their stamps. What the drive
/// cannot tell (it never is fast or steep enough) is the MTi-G's own: x forward, y left, z up, yaw
/// from north counter-clockwise. Without a log there are no samples, and a remark. InputError:
/// several logs, more than one line in a hundred broken, positions that are no places.
[[nodiscard]] StLuciaIns read_st_lucia_ins(const std::filesystem::path& folder);

}  // namespace vergence::app
