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

/// Recorded session as the source of another one. The estimator gets the same input in the same
/// order, including missing images, and its solver finishes at the same frames. So the poses are
/// bit for bit those of the recorded run, unless other settings are requested.
///
/// Owns the recording. `request` must outlive it. The constructor throws InputError for a damaged
/// description, or images of another size than the calibration's.
class SessionSource final : public FrameSource {
 public:
  /// `other` replaces the recorded initial calibration; calibrations are then adopted after a fixed
  /// number of frames. Precondition: request.start is a frame of the session.
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
  // Without frames after finish().
  RecordedSession session_;
  // True for another initial calibration.
  const bool other_;
  // Index after the last frame of this replay.
  const std::size_t end_;
  SourceFacts facts_;
  // Images of the frame in hand.
  std::array<std::vector<std::uint8_t>, kMaxCameras> pixels_;
  std::atomic<bool> stopped_{false};

  // Used by the estimator's thread; read by others after joining it.
  std::size_t next_frame_ = 0, next_reading_ = 0;
  // True if reported for the next frame.
  bool recalibration_reported_ = false;
  std::uint64_t images_missing_ = 0;
  // Decodes on its own thread, because decoding allocates.
  ThreadRunner reader_{BackgroundThread::Role::reader};
};

/// Initial calibration of a recorded session. Throws InputError for a damaged description.
[[nodiscard]] StartingCalibration recorded_beginning(const SessionDescription& description,
                                                     const std::string& name);

}  // namespace vergence::app
