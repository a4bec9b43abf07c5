#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/publish/frame_images.hpp"
#include "app/publish/line_socket.hpp"
#include "app/publish/pose_stream.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"
#include "core/calibration/options.hpp"
#include "core/memory/ring.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// `publish.pose_stream`: the pose stream to robots and bridges (docs/live_interface.md). A line
/// per frame, the calibration and the alignment when a reader connects and when they change, a
/// status per second; images on the connections that request them.
///
/// Threads  on_…(): the estimator's, which pushes into rings, copies two images where a reader is
///          due, and wakes; no lock, no system call but the wake. Formatting, sending and requests:
///          a thread of its own, made by the constructor.
/// Memory   Fixed for the estimator's part; from the first request for images on, two pairs of them
///          and one for each reader that requested them. Ring full: that line is left out and
///          counted.
/// Errors   The constructor throws std::system_error when no thread can be had.
class LinePublisher final : public SessionObserver {
 public:
  /// `requests` outlives it. `options`: what a calibration is rated by.
  LinePublisher(std::unique_ptr<LineSocket> socket, SessionRequests* requests,
                const calibration::CalibrationOptions& options);
  /// Sends what waits, then ends the thread.
  ~LinePublisher() override;
  LinePublisher(const LinePublisher&) = delete;
  LinePublisher& operator=(const LinePublisher&) = delete;

  void on_start(const SessionStart& start) noexcept override;
  void on_frame(const RigFrame& frame) noexcept override {
    if (images_.copy(frame)) images_.finish();
  }
  void on_pose(const FrameReport& report) noexcept override;
  void on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept override;
  void on_reading(const InsRecord& reading) noexcept override;
  void on_event(const EventRecord& event) noexcept override;
  void on_calibration(const CalibrationRecord& calibration) noexcept override;
  /// Sends what waits first: to be called when no more poses come.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override;
  /// From mid-exposure to the line, ms, 99th percentile so far; negative: not known. Any thread.
  [[nodiscard]] double age_p99_ms() const noexcept {
    return age_p99_ms_.load(std::memory_order_relaxed);
  }

 private:
  void work() noexcept;
  void drain();
  void send(const FrameReport& report);
  void send_status(HostStamp now);
  void send_images();
  [[nodiscard]] LineResponse answer(std::string_view request);
  void wake() noexcept;
  void stop() noexcept;

  std::unique_ptr<LineSocket> socket_;
  SessionRequests* requests_;
  calibration::CalibrationOptions options_;
  FileDescriptor wake_;   // an eventfd
  SessionStart start_{};  // published by started_
  std::atomic<bool> started_{false}, stop_{false};

  // From the estimator's thread to the publisher's.
  Ring<FrameReport, 64> reports_;
  Ring<PublishedEnuAlignment, 8> alignments_;
  Ring<CalibrationRecord, 4> calibrations_;
  FrameImages images_;
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> verified_{false};
  std::atomic<std::int64_t> sample_ns_{0};  // arrival of the newest INS sample; 0: none
  std::atomic<FixStatus> fix_{FixStatus::none};

  std::atomic<double> age_p99_ms_{-1};

  // Used by the publisher's thread only.
  std::optional<PublishedEnuAlignment> alignment_{};
  std::optional<FrameReport> newest_{};
  std::string calibration_line_{}, alignment_line_{};
  HostStamp status_due_{};
  std::string line_, image_bytes_;
  std::uint64_t lines_ = 0;
  TimeHistogram age_, behind_pose_;  // ms
  std::thread thread_;
};

}  // namespace vergence::app
