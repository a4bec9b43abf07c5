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

/// A point that the left camera followed, raw pixels, and where the right one saw it.
struct LivePoint {
  std::array<float, 2> left{}, right{};
  bool both = false;
};

/// A grey JPEG of the image, at most kThumbnailWidth pixels wide; empty for an empty image.
[[nodiscard]] std::string thumbnail(const ImageView& image);
inline constexpr int kThumbnailWidth = 480;

/// RFC 4648.
[[nodiscard]] std::string base64(std::string_view bytes);

/// `publish.http`: the live page (docs/live_interface.md).
///
/// Threads  on_…(): the estimator's, which pushes into rings and, when a viewer waits for a
///          picture, copies two images; no lock, no system call. Everything else: a thread
///          of its own, made by the constructor, that yields to the estimator's where a core is
///          short.
/// Memory   Rings fixed; the images' memory with the first viewer. Ring full: frames are left out,
///          totals stay true.
/// Errors   The constructor throws InputError (HttpServer), std::system_error.
class LivePage final : public SessionObserver {
 public:
  struct Options {
    HostPort address{};
    HttpPolicy policy{};
  };

  /// `requests` outlives it. `line_age_ms`: of the pose lines, 99th percentile; negative: none.
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

  // From the estimator's thread to the page's.
  Ring<FrameReport, 64> poses_;
  Ring<FrameReport, 256> reports_;
  Ring<EventRecord, 64> events_;
  Ring<CalibrationRecord, 8> calibrations_;
  Ring<PublishedEnuAlignment, 8> alignments_;
  /// For summary.json.
  struct Counts {
    std::atomic<std::uint64_t> updates{0}, dropped{0};
  } counts_;
  FrameImages images_;
  FixedVector<LivePoint, 600> points_;  // of images_: as many as a page can show
  std::atomic<bool> started_{false}, ended_{false}, stop_{false};
  SessionStart start_{};  // published by started_

  // Used by the page's thread only.
  LiveState state_;
  bool begun_ = false;
  const std::string epoch_;  // tells a viewer that the program was started again
  nlohmann::json newest_images_{};
  std::string newest_image_{};            // number of their frame
  Clock::time_point asked_{}, wanted_{};  // for the state, for images
  HttpServer server_;
  std::thread thread_;
};

/// The live page: HTML, style sheet and script in one, from app/publish/page/. Lives as long as
/// the program.
[[nodiscard]] std::string_view page_html();

}  // namespace vergence::app
