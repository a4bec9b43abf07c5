#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "app/session/match_sample.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// Mistakes that people make when they write a calibration down, which the matches tell apart from
/// a rig that was knocked.
enum class CalibrationMistake : std::uint8_t {
  none,
  rotation_transposed,  // T_camera_left is the other way round, at least its rotation
  already_rectified,    // distortion is given for images that have none any more
};
/// One word, of summary.json; empty: none.
[[nodiscard]] std::string_view to_string(CalibrationMistake) noexcept;

/// Whether matches of frames before `before` lie on the epipolar lines of the rig with one of the
/// mistakes mended, but not on its own. The mended rig has to fit several times better and as well
/// as calibrations do, so noise and knocks are no mistakes. Camera 1 only.
[[nodiscard]] CalibrationMistake find_mistake(std::span<const RawMatch> matches,
                                              const RigCalibration& rig, std::uint64_t before);

}  // namespace vergence::app
