#pragma once
#include "tests/system/calibration/test_trajectory.hpp"

namespace vergence::test {

/// Change of the right camera and the maximum time to detect it.
struct Knock {
  const char* name;
  Vec3 turn_deg, shift_mm;
  int frames;           // within which it is noticed
  bool matches = true;  // are left across; else the left camera goes on alone for a while, and the
                        // scale is remembered
  std::uint64_t at = 60;  // frame; the monitor has a reference of its own from about 90 on
};

/// A rig that knows its calibration is knocked on the way and mended.
void expect_noticed_and_mended(const Knock& knock);

/// Change that is too small to detect, a depth error of less than half a percent: within
/// `frames` what the drive learns takes up most of it, and no pose is wrong meanwhile.
void expect_taken_up(const Knock& knock);

}  // namespace vergence::test
