#include "app/publish/live_page.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/datasets/jpeg_writer.hpp"
#include "app/publish/page_parts.hpp"  // made by CMake from app/publish/page/
#include "app/report/style.hpp"
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
  constexpr int kQuality = 70;  // grey blocks do not show beside the points
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

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBetweenUpdates{100};  // 10 a second: what an eye follows
constexpr milliseconds kFarewell{200};        // for the end of the drive to reach its viewers
constexpr int kNiceness = 5;                  // beside the estimator's threads

}  // namespace

LivePage::LivePage(const Options& options, SessionRequests* requests,
                   std::function<double()> line_age_ms)
    : requests_(requests),
      line_age_ms_(std::move(line_age_ms)),
      server_(options.address, options.policy, page_html(), options.viewers,
              [this](HttpRoute route) { act(route); }),
      thread_([this] {
        try {
          work();
        } catch (
            const std::exception& e) {  // no memory: whoever looks loses the page, not the drive
          fmt::print(stderr, "vergence: the live page has ended ({}); the run continues\n",
                     e.what());
        }
      }) {}

LivePage::~LivePage() {
  stop_.store(true, std::memory_order_release);
  thread_.join();
}

// ---- the session's threads

void LivePage::on_start(const SessionStart& start) noexcept {
  start_ = start;
  started_.store(true, std::memory_order_release);
}

void LivePage::on_tracks(const calibration::TrackLog& tracks) noexcept {
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

void LivePage::on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept {
  push(&alignments_, {alignment, origin});
}

void LivePage::on_report(const FrameReport& report) noexcept { push(&reports_, report); }
void LivePage::on_event(const EventRecord& event) noexcept { push(&events_, event); }
void LivePage::on_calibration(const CalibrationRecord& calibration) noexcept {
  push(&calibrations_, calibration);
}

std::vector<std::pair<std::string, std::uint64_t>> LivePage::counters() {
  ended_.store(true, std::memory_order_release);
  return {{"page_updates", counts_.updates.load(std::memory_order_relaxed)},
          {"page_dropped", counts_.dropped.load(std::memory_order_relaxed)}};
}

// ---- the page's thread

void LivePage::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-page");
  // On Linux a thread has a niceness of its own.
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNiceness);
  while (!stop_.load(std::memory_order_acquire)) {
    const auto wait = std::chrono::ceil<milliseconds>(shown_ + kBetweenUpdates - Clock::now());
    // The end of the drive is looked for as often.
    server_.step(server_.viewers() > 0 ? std::clamp(wait, milliseconds(0), kBetweenUpdates)
                                       : kBetweenUpdates);
    drain();
    if (server_.viewers() > 0 && Clock::now() >= shown_ + kBetweenUpdates) show();
  }
  drain();
  if (server_.viewers() > 0) show();
  server_.flush(kFarewell);
}

void LivePage::drain() {
  if (!begun_ && started_.load(std::memory_order_acquire)) {
    state_.begin(start_);
    begun_ = true;
  }
  // Before the rings: what is in them by then is all of the drive.
  const bool ended = ended_.load(std::memory_order_acquire);
  for (CalibrationRecord record; calibrations_.pop(&record);) state_.add(record);
  for (PublishedEnuAlignment alignment; alignments_.pop(&alignment);) state_.add(alignment);
  for (FrameReport report; reports_.pop(&report);) state_.add(report);
  for (EventRecord event; events_.pop(&event);) state_.add(event);
  if (ended) state_.end();
}

void LivePage::show() {
  // Ten a second, not a little fewer; what was late is not made up for.
  shown_ = std::max(shown_ + kBetweenUpdates, Clock::now() - kBetweenUpdates / 2);
  if (!begun_) return;  // the mock's world takes its time; viewers wait for the session
  counts_.updates.fetch_add(1, std::memory_order_relaxed);
  const HostStamp now = monotonic_now();
  server_.broadcast("update", state_.update(now, line_age_ms_()), HttpServer::Skipped::greet_again);
  // After the update: what a greeting has is not told again.
  server_.greet("hello", [this, now] { return state_.hello(now); });
  if (images_.ready()) {
    show_images();
    images_.done();
  }
  images_.want(start_.image_bytes);
}

void LivePage::show_images() {
  nlohmann::json out{{"frame", images_.frame()}, {"images", nlohmann::json::array()}};
  for (std::size_t k = 0; k < FrameImages::kImages; ++k) {
    const ImageView image = images_.image(k);
    out["images"].push_back(
        {{"width", image.width}, {"height", image.height}, {"jpeg", base64(thumbnail(image))}});
  }
  auto& points = out["points"] = nlohmann::json::array();
  // Tenths of pixels, as integers: half the bytes.
  const auto tenths = [](float v) { return static_cast<int>(v * 10 + 0.5F); };
  for (const LivePoint& p : points_) {
    nlohmann::json point{tenths(p.left[0]), tenths(p.left[1])};
    if (p.both) {
      point.push_back(tenths(p.right[0]));
      point.push_back(tenths(p.right[1]));
    }
    points.push_back(std::move(point));
  }
  server_.broadcast("images", out.dump(), HttpServer::Skipped::harmless);
}

void LivePage::act(HttpRoute route) noexcept {
  constexpr auto kOrder = std::memory_order_relaxed;
  if (route == HttpRoute::recalibrate) requests_->recalibrate.store(true, kOrder);
  if (route == HttpRoute::mark) requests_->mark.store(true, kOrder);
  if (route == HttpRoute::stop_recording) requests_->stop_recording.store(true, kOrder);
}

std::string_view page_html() {
  static const std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\"><title>vergence</title><style>" +
      report::palette() + kPageCss + "</style></head>" + kPageBody + "<script>" + kPageScript +
      "</script></html>\n";
  return page;
}

}  // namespace vergence::app
