#pragma once
#include "app/session/session_runner.hpp"

namespace vergence::app {

/// Request of a replay; checked against the data by run_replay().
struct ReplayRequest {
  SessionOptions session{};
  std::filesystem::path data;
  SequenceFormat format = SequenceFormat::kitti;
  /// Topics of a bag.
  BagTopics topics{};
  /// File of any supported program, in place of the data set's calibration.
  std::optional<std::string> calibration{};
  /// Used in place of a calibration.
  std::optional<AssumedIntrinsics> known{};
  /// In m, in place of the calibration's length.
  std::optional<double> baseline{};
  /// Uses only intrinsics and length of the calibration.
  bool from_scratch = false;
  /// Calibrates from the whole sequence before the replay.
  bool calibrate_first = false;
  /// Index of the first frame.
  std::size_t start = 0;
  /// Maximum number of frames; empty for all.
  std::optional<std::size_t> frames{};
  Configuration configuration{};

  /// Number of frames of the sequence to replay. Precondition: start is one of them.
  [[nodiscard]] std::size_t count_of(const StereoSequence& sequence) const {
    return std::min(frames.value_or(sequence.pairs.size()), sequence.pairs.size() - start);
  }
};

/// Sequence of a request, with the supplied calibration, if any. Prints on stderr what a
/// calibration's format lacked. Throws InputError as open_sequence() does.
[[nodiscard]] StereoSequence open_drive(const ReplayRequest& request);

/// Recorded configuration (KEY=VALUE) of a session, as far as poses depend on it. Throws InputError
/// as RecordedSession::open() does.
[[nodiscard]] std::vector<std::string> recorded_settings(const std::filesystem::path& session);

/// Replays a recorded sequence: estimates a pose per frame, writes the session directory and
/// evaluates against the ground truth (run_session()). Throws InputError before the directory is
/// made, as far as possible; later errors are messages on stderr. Returns as run_session() does.
[[nodiscard]] ExitCode run_replay(const ReplayRequest& request);

}  // namespace vergence::app
