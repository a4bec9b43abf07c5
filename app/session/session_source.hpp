#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/datasets/recorded_session.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"

namespace vergence::app {

/// A recorded session as the source of another: the estimator is given what it was given then, in
/// the same order, images that were missing included, and its solver answers at the same frames. So
/// the poses are those of the drive, bit for bit, unless something else is asked for.
///
/// Ownership  Holds the recording. `request` outlives it.
/// Errors     The constructor throws InputError: a damaged description, images of another size than
///            the calibration's.
class SessionSource final : public FrameSource {
 public:
  /// `other`: begins with this instead of what the drive began with, adopting after a fixed number
  /// of frames. Precondition: request.start is a frame of it.
  SessionSource(const ReplayRequest& request, RecordedSession session,
                std::optional<StartingCalibration> other);

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* /*faults*/) override {}
  [[nodiscard]] bool next(SourceItem* item) noexcept override;
  void done(const PoseSample& /*sample*/) noexcept override {}
  void stop() noexcept override { stopped_.store(true, std::memory_order_relaxed); }
  void finish(Progress* progress, std::vector<std::string>* faults) override;
  void describe(const SessionTotals& totals, const Estimator& estimator,
                SummaryInput* input) const override;
  void print_metrics(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const override;

 private:
  [[nodiscard]] SourceFrame load(const RecordedFrame& frame) noexcept;

  const ReplayRequest& request_;
  // Has no frames after finish().
  RecordedSession session_;
  // True if the replay begins at another frame than the recorded run.
  const bool other_;
  // Index after the last frame of this replay.
  const std::size_t end_;
  SourceFacts facts_;
  // Images of the current frame.
  std::array<std::vector<std::uint8_t>, kMaxCameras> pixels_;
  std::atomic<bool> stopped_{false};

  // Used by the estimator's thread; read by others after it has joined.
  std::size_t next_frame_ = 0, next_reading_ = 0;
  // True if the recalibration of the next frame was reported.
  bool recalibration_reported_ = false;
  std::uint64_t images_missing_ = 0;
  // Decoding allocates and therefore runs in its own thread.
  ThreadRunner reader_{BackgroundThread::Role::reader};
};

/// Returns the initial calibration of a recorded session. InputError: the recording's description
/// is damaged.
[[nodiscard]] StartingCalibration recorded_beginning(const SessionDescription& description,
                                                     const std::string& name);

}  // namespace vergence::app
