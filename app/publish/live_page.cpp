#include "app/publish/live_page.hpp"

#include <pthread.h>
#include <sys/resource.h>

#include <cstdio>
#include <exception>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/datasets/image_writer.hpp"
#include "app/publish/frame_images.hpp"
#include "app/publish/live_state.hpp"
// CMake generates this header from app/publish/page/.
#include "app/publish/page_parts.hpp"
#include "app/report/page_css.hpp"
#include "app/runtime/text_input.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/memory/ring.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

std::string thumbnail(const ImageView& image) {
  const int step = std::max(1, (image.width + kThumbnailWidth - 1) / kThumbnailWidth);
  const int width = image.width / step, height = image.height / step;
  if (image.empty() || height < 1) return {};
  std::vector<std::uint8_t> means;
  means.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      int sum = step * step / 2;
      for (int i = 0; i < step * step; ++i)
        sum += image.row(y * step + i / step)[x * step + i % step];
      means.push_back(static_cast<std::uint8_t>(sum / (step * step)));
    }
  // Compression artefacts are hidden by the points.
  constexpr int kQuality = 70;
  return grey_jpeg({means.data(), width, height, width}, kQuality);
}

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  const auto byte = [&bytes](std::size_t i) {
    return i < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i])) : 0U;
  };
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    for (unsigned k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[three >> (18U - 6U * k) & 63U];
  }
  return out;
}

std::string_view page_html() {
  static const std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\"><title>vergence</title><style>" +
      std::string(report::kPalette) + kPageCss + "</style></head>" + kPageBody + "<script>" +
      kPageScript + "</script></html>\n";
  return page;
}

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBetweenImages{100};
// Time for viewers to receive the end of the session.
constexpr milliseconds kFarewell{500};
// The estimator's threads take precedence.
constexpr int kNiceness = 5;

/// Point tracked by the left camera in raw pixels, and its position in the right image.
struct LivePoint {
  std::array<float, 2> left{}, right{};
  bool both = false;
};

/// Live page of `publish.http` (docs/live_interface.md).
///
/// Threads  on_…() run on the estimator's thread: they push into rings and, if a viewer waits for
///          an image, copy two images, without a lock or system call. Everything else runs on an
///          own thread with a lower priority, which the constructor starts.
/// Memory   Rings are fixed; images are allocated for the first viewer. If a ring is full, frames
///          are dropped, but totals stay correct.
/// Errors   The constructor throws InputError (HttpServer) and std::system_error.
class LivePage final : public SessionObserver {
 public:
  /// `requests` must outlive it.
  LivePage(const HostPort& address, const HttpPolicy& policy, SessionRequests* requests)
      : requests_(requests),
        epoch_(std::to_string(monotonic_now().ns())),
        server_(
            address, policy, page_html(),
            [this](HttpRoute route, const HttpRequest& request) { return handle(route, request); }),
        thread_([this] {
          try {
            work();
          } catch (const std::exception& e) {
            // Without memory viewers lose the page, but the session continues.
            fmt::print(stderr, "vergence: the live page has ended ({}); the run continues\n",
                       e.what());
          }
        }) {}

  ~LivePage() override {
    stop_ = true;
    thread_.join();
  }

  void on_start(const SessionStart& start) noexcept override {
    start_ = start;
    started_ = true;
  }

  void on_frame(const RigFrame& frame) noexcept override { (void)images_.copy(frame); }
  void on_tracks(const calibration::TrackLog& tracks) noexcept override {
    if (!images_.copying()) return;
    points_.clear();
    if (!tracks.empty() && tracks.frame(tracks.size() - 1).number == images_.frame())
      for (const calibration::LoggedObservation& o : tracks.frame(tracks.size() - 1).observations) {
        if (!o.by(0)) continue;
        LivePoint point{{o.raw[0].x(), o.raw[0].y()}, {}, o.by(1)};
        if (point.both) point.right = {o.raw[1].x(), o.raw[1].y()};
        if (!points_.push(point)) break;
      }
    images_.finish();
  }

  void on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept override {
    push(PublishedEnuAlignment{alignment, origin});
  }

  void on_pose(const FrameReport& report) noexcept override { push(PosedFrame{report}); }

  void on_report(const FrameReport& report) noexcept override { push(report); }

  void on_event(const EventRecord& event) noexcept override { push(event); }

  void on_calibration(const CalibrationRecord& calibration) noexcept override { push(calibration); }

  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override {
    ended_ = true;
    return {{"page_updates", updates_}, {"page_dropped", dropped_}};
  }

 private:
  using Clock = std::chrono::steady_clock;

  using Item =
      std::variant<PosedFrame, FrameReport, EventRecord, CalibrationRecord, PublishedEnuAlignment>;

  void push(const Item& item) noexcept {
    if (!items_.push(item)) ++dropped_;
  }
  void work() {
    (void)pthread_setname_np(pthread_self(), "vergence-page");
    // On Linux each thread has its own niceness.
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNiceness);
    while (!stop_) {
      server_.step(milliseconds(100));
      drain();
    }
    const Clock::time_point end = Clock::now() + kFarewell;
    if (asked_ + kFarewell > Clock::now())
      while (Clock::now() < end) server_.step(milliseconds(20));
  }

  void drain() {
    if (!begun_ && started_) {
      state_.begin(start_);
      begun_ = true;
    }
    // The flag is read before the rings, which then contain the rest of the session.
    const bool ended = ended_;
    for (Item item; items_.pop(&item);)
      std::visit([this](const auto& record) { state_.add(record); }, item);
    if (ended) state_.end();
  }

  [[nodiscard]] std::string handle(HttpRoute route, const HttpRequest& request) {
    if (route == HttpRoute::state) return state_since(request);
    if (route == HttpRoute::recalibrate) requests_->recalibrate = true;
    if (route == HttpRoute::mark) requests_->mark = true;
    if (route == HttpRoute::stop_recording) requests_->stop_recording = true;
    return "";
  }

  [[nodiscard]] std::string state_since(const HttpRequest& request) {
    asked_ = Clock::now();
    drain();
    // Viewers wait for the session, because the simulated world starts slowly.
    if (!begun_) return "";
    ++updates_;
    const bool known = request.epoch == epoch_;
    std::uint64_t version = 0;
    if (known) (void)parse_whole(request.after, &version);
    nlohmann::json out = state_.since(version, monotonic_now());
    out["epoch"] = epoch_;
    if (images_.ready()) {
      newest_images_ = images_json();
      newest_image_ = std::to_string(images_.frame());
      images_.done();
    }
    if (!newest_image_.empty() && !(known && request.image == newest_image_))
      out["images"] = newest_images_;
    if (asked_ >= wanted_ + kBetweenImages) {
      wanted_ = asked_;
      images_.want(start_.image_bytes);
    }
    return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }

  [[nodiscard]] nlohmann::json images_json() const {
    nlohmann::json out{{"frame", images_.frame()}, {"images", nlohmann::json::array()}};
    for (std::size_t k = 0; k < FrameImages::kImages; ++k) {
      const ImageView image = images_.image(k);
      out["images"].push_back(
          {{"width", image.width}, {"height", image.height}, {"jpeg", base64(thumbnail(image))}});
    }
    auto& points = out["points"] = nlohmann::json::array();
    // Tenths of pixels as integers halve the size.
    const auto tenths = [](float v) { return static_cast<int>(v * 10 + 0.5F); };
    for (const LivePoint& p : points_) {
      nlohmann::json point{tenths(p.left[0]), tenths(p.left[1])};
      if (p.both) point.insert(point.end(), {tenths(p.right[0]), tenths(p.right[1])});
      points.push_back(std::move(point));
    }
    return out;
  }

  SessionRequests* requests_;

  // Passed from the estimator's thread to the page's.
  Ring<Item, 256> items_;
  std::atomic<std::uint64_t> updates_{0}, dropped_{0};
  FrameImages images_;
  // Points of the images in images_: the maximum that a page can show.
  FixedVector<LivePoint, 600> points_;
  std::atomic<bool> started_{false}, ended_{false}, stop_{false};
  // Published by started_.
  SessionStart start_{};

  // Used by the page's thread only.
  LiveState state_;
  bool begun_ = false;
  // Identifies this run, so that viewers detect a restart.
  const std::string epoch_;
  nlohmann::json newest_images_{};
  // Frame number of newest_images_.
  std::string newest_image_{};
  // Times of the last request for the state, and of the last one for images.
  Clock::time_point asked_{}, wanted_{};
  HttpServer server_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<SessionObserver> make_live_page(const HostPort& address, const HttpPolicy& policy,
                                                SessionRequests* requests) {
  return std::make_unique<LivePage>(address, policy, requests);
}

}  // namespace vergence::app
