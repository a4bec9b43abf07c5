#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/datasets/frame_decoder.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"
#include "core/comparison/comparison.hpp"
#include "core/memory/frame_pool.hpp"

namespace vergence::app {

/// INS of a replayed sequence and the options of its comparison.
struct ReplayedIns {
  /// Samples around the replayed frames; empty without an INS.
  std::vector<InsRecord> readings{};
  ComparisonOptions options{};
  std::string mount_source{};
  std::vector<std::string> remarks{};
};

/// Reads the samples for the frames [request.start, …) of the sequence. Configured extrinsics
/// (`ins.lever_arm_m`, `ins.boresight_deg`) take precedence over the data set's.
/// `comparison.max_gap_ms` and `max_wait_ms` are at least 1.5 of the recording's usual interval.
/// Throws InputError as read_recorded_ins() and comparison_options() do.
[[nodiscard]] ReplayedIns replayed_ins(const ReplayRequest& request,
                                       const StereoSequence& sequence);

/// A recorded drive as the source of a session. Nothing is dropped; an INS that was recorded comes
/// in the order of its stamps, before the frames that are not older.
///
/// Ownership  Holds the sequence and the pool that its images are decoded into. `request` outlives
///            it.
class RecordedSource final : public FrameSource {
 public:
  /// `truth`: of the data set, may be empty. Precondition: request.start is a frame of it.
  RecordedSource(const ReplayRequest& request, StereoSequence sequence, StartingCalibration begin,
                 Trajectory truth, ReplayedIns ins);

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* faults) override;
  [[nodiscard]] bool next(SourceItem* item) noexcept override;
  void done(const PoseSample& sample) noexcept override;
  void stop() noexcept override;
  void finish(Progress* progress, std::vector<std::string>* faults) override;
  void describe(const SessionTotals& totals, const Estimator& estimator,
                SummaryInput* input) const override;
  void print_metrics(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const override;

 private:
  const ReplayRequest& request_;
  const StereoSequence sequence_;
  const ReplayedIns ins_;
  // Number of frames in this replay.
  const std::size_t count_;
  Arena frames_arena_;
  FramePool pool_;
  SourceFacts facts_;
  std::unique_ptr<FrameDecoder> decoder_;

  // Used by the estimator's thread; read by others after it has joined.
  // Last pair returned, or the one that waits until its INS samples have been returned.
  DecodedPair pair_{};
  // True if `pair_` was not returned yet.
  bool waiting_ = false;
  // True if there are no more pairs.
  bool ended_ = false;
  std::size_t next_reading_ = 0;
  // Number of frames in `skipped_` that the decoder reached.
  std::uint64_t unread_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace vergence::app
