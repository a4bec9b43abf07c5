#pragma once
#include <cstdint>
#include <filesystem>

#include "app/config/configuration.hpp"

namespace vergence::test {

/// How the drive is written.
struct KittiRawForm {
  bool rectified = false;  // `sync`; the configuration's cameras then are parallel and without
                           // distortion. Else `extract`
  bool noisy_oxts =
      false;  // with the errors of a unit with RTK (below); else as the mock's INS gives them
  std::uint64_t seed = 1;  // of these errors
};

/// Drives the mock of `configuration` (two cameras, its INS) in virtual time and writes what its
/// devices bring as a KITTI raw drive below
/// `folder`: DATE/DATE_drive_0001_{extract,sync} and DATE/calib_*.txt. The lever arm and the
/// boresight of the configuration become calib_imu_to_velo and calib_velo_to_cam. Stamps are those
/// of `vergence run --fast`, less some milliseconds for the right camera.
///
/// Errors of the packets: place wanders by 3 cm (Gauss–Markov, 20 s) and scatters by 1 cm, height
/// twice that, velocity 2 cm/s, roll and pitch wander by 0.03°, heading by 0.1° (60 s), stamps
/// scatter by 2 ms: what an RT3003 is specified to, and arrivals on a PC. Returns the drive's
/// folder.
std::filesystem::path write_kitti_raw(const app::Configuration& configuration, double duration_s,
                                      const KittiRawForm& form,
                                      const std::filesystem::path& folder);

}  // namespace vergence::test
