#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/datasets/stereo_sequence.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app {

/// The INS of a drive that is replayed, and how it is compared.
struct ReplayedIns {
  std::vector<InsRecord> readings{};  // around the frames that are replayed; empty: there is no INS
  ComparisonOptions options{};
  std::string mount_source{};
  std::vector<std::string> remarks{};  // messages
};

/// Reads the frames [request.start, …) of the sequence. A mount that the configuration says
/// (`ins.lever_arm_m`, `ins.boresight_deg`) stands before the data set's own;
/// `comparison.max_gap_ms` and `max_wait_ms` are no less than one and a half of the recording's
/// usual interval. InputError: as read_recorded_ins() and comparison_options() say.
[[nodiscard]] ReplayedIns replayed_ins(const ReplayRequest& request,
                                       const StereoSequence& sequence);

/// `truth`: of the data set, may be empty. Precondition: request.start is a frame of the sequence;
/// `request` outlives the source.
[[nodiscard]] std::unique_ptr<FrameSource> make_recorded_source(const ReplayRequest& request,
                                                                StereoSequence sequence,
                                                                StartingCalibration begin,
                                                                Trajectory truth, ReplayedIns ins);

}  // namespace vergence::app
