#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/datasets/trajectory_files.hpp"
#include "app/session/starting_calibration.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence::test {

/// A recorded drive of the shared data with its truth.
struct RecordedSequence {
  std::string name;
  app::StereoSequence sequence;
  app::Trajectory truth;
};

inline constexpr std::array kRecordedSequences = {"kitti06_51", "kitti01_51", "kitti00_151",
                                                  "euroc_mh01"};
/// All drives there are, also those of which no truth in six degrees of freedom is known.
inline constexpr std::array kRecordedDrives = {"kitti06_51",     "kitti01_51",   "kitti00_151",
                                               "euroc_mh01",     "euroc_pallet", "sand_rover",
                                               "boofcv_backyard"};
/// By the name of its folder below data/; empty: it is not there.
[[nodiscard]] std::optional<RecordedSequence> open_recorded(const std::string& name);
/// Opens the drives named `only`, or all of them if it is "all", one after the other. Returns
/// whether there was any; those that are not there are named on the standard error output.
bool for_recorded(std::span<const char* const> drives, const std::string& only,
                  const std::function<void(RecordedSequence*)>& each);

/// The right camera turned about its centre from a frame on, its images written into `folder`: by a
/// homography, which is exact for a lens without distortion.
[[nodiscard]] app::StereoSequence with_right_turned(const RecordedSequence& drive,
                                                    const Vec3& degrees, std::size_t from,
                                                    const std::filesystem::path& folder);
/// The right images left for right: no lens model makes that fit.
[[nodiscard]] app::StereoSequence with_right_mirrored(const RecordedSequence& drive,
                                                      const std::filesystem::path& folder);

/// As given, with all focal lengths `factor` of what they were.
[[nodiscard]] app::StartingCalibration with_focal_length(const app::StartingCalibration& given,
                                                         double factor);

/// Only intrinsics and baseline length of the drive's calibration are read.
[[nodiscard]] app::StartingCalibration blank(const app::StartingCalibration& given);

/// Result of one pass. Frames count from 0; −1: never.
struct DriveOutcome {
  int frames = 0, ok = 0, degraded = 0, lost = 0;
  // Number of reports of a knock or of a rig that is not rigid before `knock_at`.
  int knocks = 0;
  int verified_at = -1, since_verified = 0, ok_since_verified = 0;
  int contradicted_at = -1, ok_before_verified = 0;
  // Frames of the report and of the recalibration after a knock.
  int reported_at = -1, recalibrated_at = -1, ok_before_recalibrated = 0;
  double contradicted_percent = 0;
  // ate_scaled_m is the error after one scale.
  double ate_m = 0, ate_scaled_m = 0, scale = 1;
  // −1 if the drive is too short for segments of 10 to 50 m.
  double segments_percent = -1;
  // Result of the last decision with held-out frames.
  double held_out_px = 0;
  // The newest measurement.
  FocalMeasurement focal;
  // Calibration in use at the end.
  std::optional<RigCalibration> rig;
  // One sample per frame.
  std::vector<PoseSample> samples;
  // Number of adopted calibrations and frame of the first adoption.
  int adopted = 0, adopted_at = -1;
  // Smallest share of map points that an adoption kept.
  double points_kept_percent = 100;
};

/// `knock_at`: the frame from which on the images are of a turned camera, if any.
[[nodiscard]] DriveOutcome drive_recorded(const RecordedSequence& drive,
                                          const app::StereoSequence& sequence,
                                          const app::Configuration& c,
                                          const app::StartingCalibration& begin,
                                          std::size_t knock_at = ~std::size_t{0});

}  // namespace vergence::test
