#pragma once
#include <string>
#include <vector>

namespace vergence::bench {

/// `calibration_bench drives`: every recorded drive, its calibration given, wrong, found; knocks on
/// real images. → exit code.
int run_drives(const std::vector<std::string>& set, const std::string& only);

/// `calibration_bench stretches DATA…`: normalised squared differences of disjoint stretches
/// (METHOD §6.5), of recorded drives and of a rendered one. → exit code.
int run_stretches(const std::vector<std::string>& set, const std::string& only);

/// `calibration_bench focal`: recorded drives with focal lengths that are off, whether that is told
/// and what the drive measures. → exit code.
int run_focal_lengths(const std::vector<std::string>& set, const std::string& only);

/// `calibration_bench jumps`: how far disparities are from what the frame before makes of them, on
/// recorded drives that nobody touched. → exit code.
int run_jumps(const std::vector<std::string>& set, const std::string& only);

}  // namespace vergence::bench
