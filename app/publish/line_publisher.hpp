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

/// Publishes the pose stream to robots and bridges (docs/live_interface.md): a line per frame,
/// calibration and alignment when a reader connects and when they change, a status per second, and
/// images on request.
///
/// Threads  on_…() run on the estimator's thread: they fill rings, copy two images if a reader is
///          due, and wake, without a lock or another system call. The constructor starts a thread
///          for formatting, sending and requests.
/// Memory   Fixed for the estimator's part. After the first request for images two pairs, and one
///          per requesting reader. If a ring is full, the line is dropped and counted.
/// Errors   The constructor throws std::system_error if there is no thread.
class LinePublisher final : public SessionObserver {
 public:
  /// `requests` must outlive it. `options` rate a calibration.
  LinePublisher(std::unique_ptr<LineSocket> socket, SessionRequests* requests,
                const calibration::CalibrationOptions& options);
  /// Sends the remaining lines, then ends the thread.
  ~LinePublisher() override;

  void on_start(const SessionStart& start) noexcept override;
  void on_frame(const RigFrame& frame) noexcept override {
    if (images_.copy(frame)) images_.finish();
  }
  void on_pose(const FrameReport& report) noexcept override;
  void on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept override;
  void on_reading(const InsRecord& reading) noexcept override;
  void on_event(const EventRecord& event) noexcept override;
  void on_calibration(const CalibrationRecord& calibration) noexcept override;
  /// Sends the remaining lines first; call when no more poses follow.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override;

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
  // Descriptor of an eventfd.
  FileDescriptor wake_;
  // Published by started_.
  SessionStart start_{};
  std::atomic<bool> started_{false}, stop_{false};

  // Passed from the estimator's thread to the publisher's.
  Ring<FrameReport, 64> reports_;
  Ring<PublishedEnuAlignment, 8> alignments_;
  Ring<CalibrationRecord, 4> calibrations_;
  FrameImages images_;
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> verified_{false};
  // Arrival of the newest INS sample; 0 if none.
  std::atomic<std::int64_t> sample_ns_{0};
  std::atomic<FixStatus> fix_{FixStatus::none};

  // Used only by the publisher's thread.
  std::optional<PublishedEnuAlignment> alignment_{};
  std::optional<FrameReport> newest_{};
  std::string calibration_line_{}, alignment_line_{};
  HostStamp status_due_{};
  std::string line_, image_bytes_;
  std::uint64_t lines_ = 0;
  // In ms.
  TimeHistogram age_, behind_pose_;
  std::thread thread_;
};

}  // namespace vergence::app
