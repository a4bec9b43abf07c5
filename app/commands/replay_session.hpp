#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/given_calibration.hpp"
#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/recorder/other_formats.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

/// What a replay is to do; checked against the data by run_replay().
struct ReplayRequest {
  std::filesystem::path data;
  SequenceFormat format = SequenceFormat::kitti;
  BagTopics topics{};  // of a bag
  std::filesystem::path out;
  std::optional<std::string> calibration;  // a file of any program, instead of the data set's own
  std::optional<KnownNumbers> known;       // instead of any calibration
  std::optional<double> baseline;          // m: instead of the calibration's length
  bool from_scratch = false;               // of the calibration only intrinsics and length are read
  bool calibrate_first = false;            // from the whole drive, then drive with what was found
  std::size_t start = 0;                   // first frame
  std::optional<std::size_t> frames;       // at most so many; all when not set
  Configuration configuration;
  std::vector<OtherFormat> also{};  // written beside the session's own files
  bool quiet = false;
  bool print_memory = false;  // a table of what is held, on stdout
};

/// A word of --format, or with `auto` what `folder` holds. InputError: none that is known.
[[nodiscard]] SequenceFormat sequence_format(const std::string& word,
                                             const std::filesystem::path& folder);
/// InputError: topics are named, and the format is none of a bag.
void check_topics(SequenceFormat format, const BagTopics& topics);

/// Reads a recorded drive, estimates a pose for every frame, writes the session folder of DESIGN §6
/// and the figures against the data set's truth.
///
/// Threads  Decoder, estimator (sealed), its worker, the calibration solver (sealed, too),
///          recorder; the caller's thread draws the progress
/// line and watches for signals. Errors   InputError before the session folder is made, for all
/// that can be known by then. Afterwards sentences on stderr. → done, not_usable (there never was a
/// pose, or a file of the session is not whole), interrupted, terminated
[[nodiscard]] ExitCode run_replay(const ReplayRequest& request);

}  // namespace vergence::app
