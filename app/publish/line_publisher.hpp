#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/publish/line_socket.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"
#include "core/comparison/comparison.hpp"
#include "core/memory/ring.hpp"
#include "core/types/pose_sample.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// Where the odometry's world lies on the earth.
struct PublishedPlacement {
  Transform T_enu_world{};
  Geodetic origin{};  // of enu

  [[nodiscard]] EarthPose of(const Transform& T_world_left) const;
};

/// One JSON object and a line feed (docs/publish.md is its schema). `age_ms`: from mid-exposure
/// to now, where stamps are tied to this machine's clock. `dropped`: lines that were not made
/// since the start. `line` is replaced; its memory is used again.
void write_pose_line(const PoseSample& pose, const std::optional<EarthPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line);

/// `publish.lines`: one JSON object a frame to robots and bridges (docs/publish.md).
///
/// Threads  on_…(): the estimator's, which pushes into a ring and wakes; no lock, no system call
///          but the wake. Formatting and sending: a thread of its own, made by the constructor.
/// Memory   Fixed for the estimator's part. Ring full: that line is not made, and counted.
/// Errors   The constructor throws std::system_error when no thread can be had.
class LinePublisher final : public SessionObserver {
 public:
  explicit LinePublisher(std::unique_ptr<LineSocket> socket);
  /// Sends what waits, then ends the thread.
  ~LinePublisher() override;
  LinePublisher(const LinePublisher&) = delete;
  LinePublisher& operator=(const LinePublisher&) = delete;

  void on_start(const SessionStart& start) noexcept override { tie_ = start.tie; }
  void on_pose(const PoseSample& sample) noexcept override;
  void on_placement(const Placement& placement, const Geodetic& origin) noexcept override;
  /// Sends what waits first: to be called when no more poses come.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override;
  /// From mid-exposure to the line, ms, 99th percentile so far; negative: not known. Any thread.
  [[nodiscard]] double age_p99_ms() const noexcept {
    return age_p99_ms_.load(std::memory_order_relaxed);
  }

 private:
  void work() noexcept;
  struct Outgoing {
    PoseSample pose{};
    HostStamp out{};  // when the estimator was done
  };
  void send(const Outgoing& outgoing);
  void stop() noexcept;

  std::unique_ptr<LineSocket> socket_;
  std::optional<ClockTie> tie_{};  // before the first pose
  Ring<Outgoing, 64> poses_;
  Ring<PublishedPlacement, 8> placements_;
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<double> age_p99_ms_{-1};
  WakeEvent wake_;
  std::atomic<bool> stop_{false};

  // Of the thread.
  std::optional<PublishedPlacement> placement_{};
  std::string line_;
  std::uint64_t lines_ = 0;
  TimeHistogram age_, behind_pose_;  // ms
  std::thread thread_;
};

}  // namespace vergence::app
