#pragma once
#include <string>
#include <vector>

namespace vergence::bench {

/// `calibration_bench learning`: KITTI 00 so many times to and fro, from scratch; what is known
/// after every solve. → exit code.
int run_learning(const std::vector<std::string>& set, int times);

/// `calibration_bench learning --only mock`: so many frames of the mock's streets at 10 Hz, to and
/// fro, from scratch, the right camera's focal lengths and centre given wrong; errors against the
/// truth with their sigmas. → exit code.
int run_mock_learning(const std::vector<std::string>& set, int frames);

}  // namespace vergence::bench
