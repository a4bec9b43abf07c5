#pragma once
#include "app/session/replay_session.hpp"
#include "core/calibration/posterior.hpp"
#include "core/calibration/rig_solver.hpp"

namespace vergence::app {

/// Calibration from a whole recorded sequence.
struct DriveCalibration {
  /// Empty if there is none; `why` then has the reason.
  std::optional<RigCalibration> rig;
  std::string why;
  /// Predicted depth error, and the depth at which it is evaluated.
  double depth_m = 0, depth_sigma_percent = 0;
  /// True if the depth error is within the tolerance.
  bool verified = false;
  /// Moving frames with tracks.
  std::uint64_t frames = 0;
  /// Independent solutions of parts of the sequence.
  std::vector<calibration::RigSolution> stretches;
  /// agreement() of each solution with the one before, and the difference of their depths at 20 m
  /// in percent, for camera 1.
  std::vector<double> agreements, depth_differences;
};

/// Callback of a pass over a sequence, called after every frame on the estimator's thread.
using DriveWatcher = std::function<void(const Estimator&, const PoseSample&)>;

struct DrivePass {
  const StereoSequence& sequence;
  const Configuration& configuration;
  /// Range of frames.
  std::size_t start = 0, count = 0;
  /// Receives the number of frames done in this pass, and stops it by returning false; may be
  /// empty.
  std::function<bool(std::size_t)> progress{};
};

/// Processes the sequence once, without a session. Returns the calibration in use at the end; empty
/// if there was none or it was stopped.
[[nodiscard]] std::optional<RigCalibration> drive_once(const DrivePass& pass,
                                                       const StartingCalibration& begin,
                                                       const DriveWatcher& watch);

/// Processes the sequence twice with twice its number of features. The first pass calibrates from
/// scratch for the tracks. The second solves for all frames in joined segments, and for each
/// segment alone to compare consecutive ones. Uses intrinsics, sigmas and baseline length of
/// `given`.
[[nodiscard]] DriveCalibration calibrate_drive(const DrivePass& pass,
                                               const StartingCalibration& given);

/// Runs calibrate_drive() with a progress line and the caller's stop signals.
[[nodiscard]] DriveCalibration calibrate_with_progress(const DrivePass& pass,
                                                       const StartingCalibration& given,
                                                       const SignalGuard& signals,
                                                       Progress* progress);

/// Text for the terminal: each parameter with its sigma, the depth error, and the agreement of the
/// segments.
[[nodiscard]] std::string describe(const DriveCalibration& found);

/// Implements `vergence calibrate sequence`: calibrates from a recorded sequence instead of a
/// target, with intrinsics and baseline length of its own or the supplied calibration. Writes the
/// file and prints the result. Returns done, or not_usable (no calibration, or its depth is too
/// uncertain). Throws InputError for data, calibration or output file.
///
///     ReplayRequest request;
///     request.data = "MH_01_easy";
///     request.format = SequenceFormat::euroc;
///     const ExitCode code = calibrate_from_drive(request, "calibration.yaml");
[[nodiscard]] ExitCode calibrate_from_drive(ReplayRequest request,
                                            const std::filesystem::path& out);

}  // namespace vergence::app
