#pragma once
#include <string>
#include <vector>

#include "app/datasets/recorded_ins.hpp"
#include "app/session/replay_session.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app {

/// The INS of a drive that is replayed, and how it is compared.
struct ReplayedIns {
  std::vector<RecordedReading>
      readings{};  // around the frames that are replayed; empty: there is no INS
  ComparisonOptions options{};
  std::string mount_source{};
  std::vector<std::string> remarks{};  // sentences
};

/// Of the frames [request.start, …) of the sequence. A mount that the configuration says
/// (`ins.lever_arm_m`, `ins.boresight_deg`) stands before the data set's own;
/// `comparison.max_gap_ms` and `max_wait_ms` are no less than one and a half of the recording's
/// usual interval. InputError: as read_recorded_ins() and comparison_options() say.
[[nodiscard]] ReplayedIns replayed_ins(const ReplayRequest& request,
                                       const StereoSequence& sequence);

}  // namespace vergence::app
