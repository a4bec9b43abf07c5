#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/recorder/match_sample.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// A part of the left image and how far matches there are from their epipolar lines: residuals.csv.
struct ResidualCell {
  int camera = 1;                                   // the other one
  double left = 0, top = 0, width = 0, height = 0;  // px, of the left image
  int matches = 0;                                  // without gross errors
  double mean_px = 0;  // signed: the point in the other image is below its line; of cameras above
                       // each other, left of it
  double scatter_px = 0;  // standard deviation
};

/// A field of 8 × 6 cells for every further camera; cells with hardly a match are left out. Matches
/// of frames in [from, before) only. Distances as the gates have them: in normalised units times
/// that camera's focal length.
[[nodiscard]] std::vector<ResidualCell> residual_field(std::span<const RawMatch> matches,
                                                       const RigCalibration& rig,
                                                       std::uint64_t from, std::uint64_t before);

/// residuals.csv: the field with the calibration that the drive began with (`begin`, may be empty)
/// and with the one at its end (`end`).
[[nodiscard]] std::string format_residuals(const std::vector<ResidualCell>& begin,
                                           const std::vector<ResidualCell>& end);

}  // namespace vergence::app
