#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "app/publish/http_server.hpp"
#include "app/publish/live_state.hpp"
#include "app/session/session_observer.hpp"
#include "core/calibration/track_log.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/memory/ring.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// A point that the left camera followed, raw pixels, and where the right one saw it.
struct LivePoint {
  std::array<float, 2> left{}, right{};
  bool both = false;
};

/// One frame's images on their way to the live page: only when somebody has asked, only every
/// so many rows.
///
/// Threads  take_images(), take_points(): the estimator's, sealed, a few hundred microseconds when
///          a frame is wanted, one load of a flag when not. The rest: one other thread. A flag says
///          whose the memory is; nobody waits.
/// Memory   reserve(), before the first frame: two images' rows that are taken.
class LiveImages {
 public:
  static constexpr int kWidth = 480;  // px at most, of what is shown
  static constexpr std::size_t kPoints = 600;

  struct Picture {
    int width = 0, height = 0;  // of the camera's image
    int step = 1;               // image pixels to one that is shown
    std::size_t bytes = 0;
    std::vector<std::uint8_t> rows{};  // `taken` of every `step` rows
    int taken = 1;
  };

  void reserve(std::size_t image_bytes);

  void take_images(const RigFrame& frame) noexcept;
  void take_points(const RigFrame& frame, const calibration::TrackLog& tracks) noexcept;

  /// Asks for the next frame, if none is asked for or here.
  void want() noexcept;
  /// A frame is here and stays until done().
  [[nodiscard]] bool ready() const noexcept {
    return owner_.load(std::memory_order_acquire) == Owner::viewer;
  }
  void done() noexcept { owner_.store(Owner::nobody, std::memory_order_release); }
  [[nodiscard]] std::uint64_t frame() const noexcept { return frame_; }
  [[nodiscard]] std::span<const Picture, 2> pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::span<const LivePoint> points() const noexcept { return points_.span(); }

 private:
  enum class Owner : std::uint8_t { nobody, estimator, filling, viewer };

  std::atomic<Owner> owner_{Owner::nobody};
  std::uint64_t frame_ = 0;
  std::array<Picture, 2> pictures_{};
  FixedVector<LivePoint, kPoints> points_;
};

/// A small grey JPEG of it; empty: there is no picture.
[[nodiscard]] std::string thumbnail(const LiveImages::Picture& picture);

/// RFC 4648.
[[nodiscard]] std::string base64(std::string_view bytes);

/// `publish.http`: the live page (docs/live_interface.md).
///
/// Threads  on_…(): the estimator's, which pushes into rings and, when a viewer waits for a
///          picture, copies rows of two images; no lock, no system call. Everything else: a thread
///          of its own, made by the constructor, that yields to the estimator's where a core is
///          short.
/// Memory   Rings fixed; the images' memory in on_start(). Ring full: frames are left out, totals
///          stay true.
/// Errors   The constructor throws InputError (HttpServer), std::system_error.
class LivePage final : public SessionObserver {
 public:
  struct Options {
    HostPort address{};
    HttpPolicy policy{};
    std::size_t viewers = 4;
  };

  /// `requests` outlives it. `line_age_ms`: of the pose lines, 99th percentile; negative: none.
  LivePage(const Options& options, SessionRequests* requests, std::function<double()> line_age_ms);
  ~LivePage() override;
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  void on_start(const SessionStart& start) noexcept override;
  void on_frame(const RigFrame& frame) noexcept override;
  void on_pose(const PoseSample& sample) noexcept override;
  void on_tracks(const calibration::TrackLog& tracks) noexcept override;
  void on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept override;
  void on_report(const FrameReport& report) noexcept override;
  void on_event(const EventRecord& event) noexcept override;
  void on_calibration(const CalibrationRecord& calibration) noexcept override;
  /// Shows the end of the drive first.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override;

 private:
  using Clock = std::chrono::steady_clock;

  template <class T, std::size_t N>
  void push(Ring<T, N>* ring, const T& value) noexcept {
    if (!ring->push(value)) counts_.dropped.fetch_add(1, std::memory_order_relaxed);
  }
  void work();
  void drain();
  void show();
  void show_images();
  void act(HttpRoute route) noexcept;

  SessionRequests* requests_;
  std::function<double()> line_age_ms_;

  LiveFrameBuilder builder_;  // of the estimator's thread

  // From it to the page's.
  Ring<LiveFrame, 256> frames_;
  Ring<FrameReport, 256> reports_;
  Ring<EventRecord, 64> events_;
  Ring<CalibrationRecord, 8> calibrations_;
  Ring<PublishedEnuAlignment, 8> alignments_;
  /// For summary.json.
  struct Counts {
    std::atomic<std::uint64_t> updates{0}, dropped{0};
  } counts_;
  LiveImages images_;
  std::atomic<bool> started_{false}, ended_{false}, stop_{false};
  SessionStart start_{};  // published by started_

  // Used by the page's thread only.
  LiveState state_;
  bool begun_ = false;
  HttpServer server_;
  Clock::time_point shown_{};
  std::thread thread_;
};

/// The live page: HTML, style sheet and script in one, from app/publish/page/. Lives as long as
/// the program.
[[nodiscard]] std::string_view page_html();

}  // namespace vergence::app
