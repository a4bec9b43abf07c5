#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/progress.hpp"
#include "app/runtime/signals.hpp"
#include "app/session/replay_session.hpp"
#include "app/session/starting_calibration.hpp"
#include "core/calibration/agreement.hpp"
#include "core/calibration/rig_solver.hpp"

namespace vergence::app {

/// A rig's calibration from a whole recorded drive.
struct DriveCalibration {
  /// None: `why` states what is missing.
  std::optional<RigCalibration> rig;
  std::string why;
  double depth_m = 0,
         depth_sigma_percent = 0;  // predicted depth error at the depth it is judged at
  /// True if the depth error is within the tolerance.
  bool verified = false;
  /// Moving frames with tracks.
  std::uint64_t frames = 0;
  /// Independent solutions of parts of the drive.
  std::vector<calibration::RigSolution> stretches;
  /// Agreement of each solution with the one before, for camera 1.
  std::vector<calibration::Agreement> agreements;
};

/// Callback of a pass over a sequence: after every frame, on the estimator's thread.
using DriveWatcher = std::function<void(const Estimator&, const PoseSample&)>;

struct DrivePass {
  const StereoSequence& sequence;
  const Configuration& configuration;
  /// Range of frames.
  std::size_t start = 0, count = 0;
  /// Called after every frame; may be empty.
  std::function<bool()> stopped{};
  /// Receives the number of frames done in this pass; may be empty.
  std::function<void(std::size_t)> progress{};
};

/// Runs the drive once, without a session. → the calibration in use at its end; empty: there never
/// was one, or it was stopped.
[[nodiscard]] std::optional<RigCalibration> drive_once(const DrivePass& pass,
                                                       const StartingCalibration& begin,
                                                       const DriveWatcher& watch);

/// Twice over the drive, with twice its features: from scratch, which gives the tracks their rig;
/// then all of its frames in segments, joined, and each segment alone, to be compared with the
/// next. `given`: the drive's own calibration; its intrinsics, sigmas and baseline length are read.
[[nodiscard]] DriveCalibration calibrate_drive(const DrivePass& pass,
                                               const StartingCalibration& given);

/// Runs a pass with a progress line that signals stop: the caller's, whose own end they are,
/// too.
[[nodiscard]] DriveCalibration calibrate_with_progress(const DrivePass& pass,
                                                       const StartingCalibration& given,
                                                       const SignalGuard& signals,
                                                       Progress* progress);

/// Formats the result as lines for the terminal: each parameter with its sigma, the depth error,
/// how far the stretches agree.
[[nodiscard]] std::string describe(const DriveCalibration& found);

/// `vergence calibrate sequence`: calibrates from an ordinary recorded sequence instead of a
/// target. Of its own or the supplied calibration intrinsics and baseline length are read. Writes
/// the file and prints the result on standard output. → done, not_usable (no calibration was found,
/// or its depth is not known well enough) Errors  InputError: data, calibration, a file that cannot
/// be written.
///
///     ReplayRequest request;
///     request.data = "MH_01_easy";
///     request.format = SequenceFormat::euroc;
///     const ExitCode code = calibrate_from_drive(request, "calibration.yaml");
[[nodiscard]] ExitCode calibrate_from_drive(ReplayRequest request,
                                            const std::filesystem::path& out);

}  // namespace vergence::app
