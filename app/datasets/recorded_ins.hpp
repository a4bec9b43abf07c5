#pragma once

#include "app/datasets/stereo_sequence.hpp"
#include "core/math/se3.hpp"
#include "drivers/ins.hpp"

/// INS data recorded with a sequence, in a common form for all data sets; a replay compares its
/// poses with it.
namespace vergence::app {

struct RecordedIns {
  /// Samples with strictly increasing stamps, on the clock of the images.
  std::vector<InsRecord> readings{};
  /// Extrinsics p_ins = T_ins_left · p_left published with the data set; empty if there are none.
  std::optional<Transform> T_ins_left{};
  /// Files that contain them.
  std::string mount_source{};
  /// Messages about skipped or assumed data.
  std::vector<std::string> remarks{};
};

/// Reads the INS of the sequence that open_sequence() opens with the same arguments, if it has
/// separate files; that of a bag is StereoSequence::ins. Without data, or data outside the
/// sequence, there are no samples. `mount_wanted` reads the published extrinsics, if any. Uses some
/// 250 bytes per sample, at most kMaxReadings. Throws InputError for missing or invalid files, or
/// without a complete sample.
[[nodiscard]] RecordedIns read_recorded_ins(SequenceFormat format,
                                            const std::filesystem::path& folder,
                                            const std::array<int, 2>& cameras, bool mount_wanted);

/// Five hours at 100 Hz.
inline constexpr std::size_t kMaxReadings = 2'000'000;

}  // namespace vergence::app
