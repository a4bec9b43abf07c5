#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/datasets/stereo_sequence.hpp"
#include "core/math/se3.hpp"
#include "core/types/ins_sample.hpp"
#include "drivers/ins.hpp"

/// The INS that was recorded with a drive, whatever the data set's own form: what a replay compares
/// its poses with.
namespace vergence::app {

struct RecordedIns {
  std::vector<InsRecord> readings{};      // stamps strictly ascending, on the clock of the images
  std::optional<Transform> T_ins_left{};  // p_ins = T_ins_left · p_left as published with the data
                                          // set; nothing: it is not
  std::string mount_source{};             // the files that say so
  std::vector<std::string> remarks{};     // what was left out or taken on trust: a message each
};

/// The INS of the drive that open_sequence() opens with the same arguments, where it has files of
/// its own; that of a bag is StereoSequence::ins. No readings: the data set has none, or none lie
/// with the drive.
/// `mount_wanted`: the published mount is read, where the data set publishes one; else somebody
/// knows better.
/// Memory  Some 250 bytes a reading, at most kMaxReadings.  InputError  As the data set's reader
/// says: files that are not there or no such files, no reading that is whole.
[[nodiscard]] RecordedIns read_recorded_ins(SequenceFormat format,
                                            const std::filesystem::path& folder,
                                            const std::array<int, 2>& cameras, bool mount_wanted);

inline constexpr std::size_t kMaxReadings = 2'000'000;  // five hours at 100 Hz

}  // namespace vergence::app
