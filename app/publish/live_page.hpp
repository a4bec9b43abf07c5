#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/publish/frame_images.hpp"
#include "app/publish/http_server.hpp"
#include "app/publish/live_state.hpp"
#include "app/session/session_observer.hpp"
#include "core/calibration/track_log.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/memory/ring.hpp"
#include "core/types/image.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// Point tracked in the left camera, in raw pixels, and its match in the right one.
struct LivePoint {
  std::array<float, 2> left{}, right{};
  bool both = false;
};

/// Grey JPEG of the image, at most kThumbnailWidth pixels wide; empty for an empty image.
[[nodiscard]] std::string thumbnail(const ImageView& image);
inline constexpr int kThumbnailWidth = 480;

/// Encoding of RFC 4648.
[[nodiscard]] std::string base64(std::string_view bytes);

/// Live page (docs/live_interface.md).
///
/// Threads  on_…() run on the estimator's thread: they fill rings and, if a viewer waits for an
///          image, copy two images, without lock or system call. The constructor starts a
///          low-priority thread for everything else.
/// Memory   Fixed rings; image memory with the first viewer. If a ring is full, frames are dropped;
///          totals stay correct.
/// Errors   The constructor throws InputError (HttpServer) and std::system_error.
class LivePage final : public SessionObserver {
 public:
  struct Options {
    HostPort address{};
    HttpPolicy policy{};
  };

  /// `requests` must outlive it. `line_age_ms` returns the 99th percentile of the pose lines' age;
  /// negative if there are none.
  LivePage(const Options& options, SessionRequests* requests, std::function<double()> line_age_ms);
  ~LivePage() override;
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  void on_start(const SessionStart& start) noexcept override;
  void on_frame(const RigFrame& frame) noexcept override { (void)images_.copy(frame); }
  void on_tracks(const calibration::TrackLog& tracks) noexcept override;
  void on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept override;
  void on_pose(const FrameReport& report) noexcept override;
  void on_report(const FrameReport& report) noexcept override;
  void on_event(const EventRecord& event) noexcept override;
  void on_calibration(const CalibrationRecord& calibration) noexcept override;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override;

 private:
  using Clock = std::chrono::steady_clock;

  template <class T, std::size_t N>
  void push(Ring<T, N>* ring, const T& value) noexcept {
    if (!ring->push(value)) counts_.dropped.fetch_add(1, std::memory_order_relaxed);
  }
  void work();
  void drain();
  [[nodiscard]] std::string handle(HttpRoute route, const HttpRequest& request);
  [[nodiscard]] std::string state_since(const HttpRequest& request);
  [[nodiscard]] nlohmann::json images_json() const;

  SessionRequests* requests_;
  std::function<double()> line_age_ms_;

  // Passed from the estimator's thread to the page's.
  Ring<FrameReport, 64> poses_;
  Ring<FrameReport, 256> reports_;
  Ring<EventRecord, 64> events_;
  Ring<CalibrationRecord, 8> calibrations_;
  Ring<PublishedEnuAlignment, 8> alignments_;
  /// Counters for summary.json.
  struct Counts {
    std::atomic<std::uint64_t> updates{0}, dropped{0};
  } counts_;
  FrameImages images_;
  // Points of images_, as many as a page can show.
  FixedVector<LivePoint, 600> points_;
  std::atomic<bool> started_{false}, ended_{false}, stop_{false};
  // Published by started_.
  SessionStart start_{};

  // Used only by the page's thread.
  LiveState state_;
  bool begun_ = false;
  // Tells a viewer that the program was restarted.
  const std::string epoch_;
  nlohmann::json newest_images_{};
  // Frame number of these images.
  std::string newest_image_{};
  // Times of the last requests for the state and for images.
  Clock::time_point asked_{}, wanted_{};
  HttpServer server_;
  std::thread thread_;
};

/// HTML, style sheet and script of the live page in one text, from app/publish/page/. Valid as long
/// as the program.
[[nodiscard]] std::string_view page_html();

}  // namespace vergence::app
