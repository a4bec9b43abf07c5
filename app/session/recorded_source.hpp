#pragma once
#include <memory>

#include "app/datasets/stereo_sequence.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app {

/// INS of a replayed sequence and the options of its comparison.
struct ReplayedIns : RecordedIns {
  ComparisonOptions options{};
};

/// Reads the samples for the frames [request.start, …) of the sequence. Configured extrinsics
/// (`ins.lever_arm_m`, `ins.boresight_deg`) take precedence over the data set's.
/// `comparison.max_gap_ms` and `max_wait_ms` are at least 1.5 of the recording's usual interval.
/// Throws InputError as read_recorded_ins() and comparison_options() do.
[[nodiscard]] ReplayedIns replayed_ins(const ReplayRequest& request,
                                       const StereoSequence& sequence);

/// A recorded drive as the source of a session, which holds the sequence. `request` outlives it.
/// `truth`: of the data set, may be empty. Precondition: request.start is a frame of it.
[[nodiscard]] std::unique_ptr<FrameSource> recorded_source(const ReplayRequest& request,
                                                           StereoSequence sequence,
                                                           StartingCalibration begin,
                                                           Trajectory truth, ReplayedIns ins);

}  // namespace vergence::app
