#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/errors.hpp"
#include "app/session/session_runner.hpp"
#include "app/session/starting_calibration.hpp"

namespace vergence::app {

/// Request of a replay; checked against the data by run_replay().
struct ReplayRequest {
  SessionOptions session{};
  std::filesystem::path data;
  SequenceFormat format = SequenceFormat::kitti;
  BagTopics topics{};                      // of a bag
  std::optional<std::string> calibration;  // a file of any program, instead of the data set's own
  std::optional<AssumedIntrinsics> known;  // instead of any calibration
  std::optional<double> baseline;          // m: instead of the calibration's length
  bool from_scratch = false;               // of the calibration only intrinsics and length are read
  bool calibrate_first = false;            // from the whole drive, then drive with what was found
  std::size_t start = 0;                   // first frame
  std::optional<std::size_t> frames;       // at most so many; all when not set
  Configuration configuration;
};

/// The drive of a request, with the calibration that the user names, if any. What a calibration's
/// format did not carry over is said on stderr. InputError: as open_sequence().
[[nodiscard]] StereoSequence open_drive(const ReplayRequest& request);

/// KEY=VALUE of the configuration that a recorded session was driven with, as far as poses depend
/// on them. InputError: as RecordedSession::open().
[[nodiscard]] std::vector<std::string> recorded_settings(const std::filesystem::path& session);

/// Reads a recorded drive, estimates a pose for every frame, writes the session folder of DESIGN §6
/// and the figures against the data set's truth (run_session()).
///
/// Errors   InputError before the session folder is made, for all that can be known by then.
///          Afterwards messages on stderr.
/// → as run_session()
[[nodiscard]] ExitCode run_replay(const ReplayRequest& request);

}  // namespace vergence::app
