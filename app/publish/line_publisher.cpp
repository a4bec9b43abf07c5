#include "app/publish/line_publisher.hpp"

#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/resource.h>

#include <cerrno>
#include <system_error>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/publish/frame_images.hpp"
#include "app/publish/pose_stream.hpp"
#include "app/session/session_totals.hpp"
#include "core/memory/ring.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

namespace {

constexpr int kNiceness = -10;
constexpr Duration kBetweenStatus = Duration::seconds(1);

class LinePublisher final : public SessionObserver {
 public:
  LinePublisher(std::unique_ptr<LineSocket> socket, SessionRequests* requests,
                const calibration::CalibrationOptions& options)
      : socket_(std::move(socket)),
        requests_(requests),
        options_(options),
        wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!wake_) throw std::system_error(errno, std::generic_category(), "eventfd");
    thread_ = std::thread([this] { work(); });
  }

  /// Sends the remaining lines, then ends the thread.
  ~LinePublisher() override { stop(); }
  void on_start(const SessionStart& start) noexcept override {
    start_ = start;
    started_ = true;
  }

  void on_frame(const RigFrame& frame) noexcept override {
    if (images_.copy(frame)) images_.finish();
  }
  void on_pose(const FrameReport& report) noexcept override {
    if (!reports_.push(report)) ++dropped_;
    wake();
  }

  // The rings hold more alignments and calibrations than a session has per second. One that finds
  // no room is superseded by the next one.
  void on_enu_alignment(const EnuAlignment& alignment, const Geodetic& origin) noexcept override {
    (void)alignments_.push({alignment, origin});
  }

  void on_reading(const InsRecord& reading) noexcept override {
    fix_ = reading.sample.fix;
    sample_ns_ = monotonic_now().ns();
  }

  void on_event(const EventRecord& event) noexcept override {
    const std::string_view kind = event.kind;
    const bool verified = kind == "calibration_verified";
    if (verified || kind == "calibration_contradicted" || kind == "rig_changed")
      verified_ = verified;
  }

  void on_calibration(const CalibrationRecord& calibration) noexcept override {
    if (!calibration.accepted) return;
    if (calibration.decided) verified_ = calibration.verified;
    (void)calibrations_.push(calibration);
    wake();
  }

  /// Sends the remaining lines first; call when no more poses follow.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override {
    stop();
    const LineSocketCounters c = socket_->counters();
    const auto us = [](double ms) { return static_cast<std::uint64_t>(ms * 1e3 + 0.5); };
    std::vector<std::pair<std::string, std::uint64_t>> out{
        {"lines", lines_},
        {"lines_dropped", dropped_},
        {"lines_sent", c.sent},
        {"lines_refused", c.refused},
        {"images_sent", c.images},
        {"line_readers", c.readers},
        {"line_readers_closed", c.closed},
        {"line_readers_turned_away", c.turned_away},
        {"line_behind_pose_p50_us", us(behind_pose_.percentile(0.5))},
        {"line_behind_pose_p99_us", us(behind_pose_.percentile(0.99))}};
    if (start_.tie)
      out.insert(out.end(), {{"line_age_p50_us", us(age_.percentile(0.5))},
                             {"line_age_p99_us", us(age_.percentile(0.99))}});
    return out;
  }

 private:
  void work() noexcept {
    (void)pthread_setname_np(pthread_self(), "vergence-lines");
    // The thread uses a tenth of a percent of a core, and readers wait for it. So it gets priority
    // where the system permits.
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNiceness);
    for (;;) {
      const bool last = stop_;
      const bool begun = started_;
      drain();
      const HostStamp now = monotonic_now();
      if (begun && now >= status_due_) send_status(now);
      if (last) return;
      send_images();
      socket_->wait(wake_.get(), begun ? status_due_ - now : kBetweenStatus,
                    [this](std::string_view request) { return answer(request); });
    }
  }

  void drain() {
    bool changed = false;
    for (CalibrationRecord record; calibrations_.pop(&record); changed = true)
      calibration_line_ = calibration_line(record, start_.camera_names, options_);
    for (PublishedEnuAlignment alignment; alignments_.pop(&alignment); changed = true) {
      alignment_ = alignment;
      alignment_line_ = alignment_line(alignment);
    }
    if (changed) socket_->greet(calibration_line_ + alignment_line_);
    for (FrameReport report; reports_.pop(&report);) send(report);
  }

  void send(const FrameReport& report) {
    const PoseSample& pose = report.pose;
    newest_ = report;
    std::optional<EnuPose> in_enu;
    if (alignment_ && pose.status != PoseStatus::lost) in_enu = alignment_->of(pose.T_world_left);
    const std::optional<ClockTie>& tie = start_.tie;
    std::optional<double> age_ms;
    if (tie) age_ms = (tie->stamp_at(monotonic_now()) - pose.stamp).to_seconds() * 1e3;
    write_pose_line(pose, in_enu, age_ms, dropped_, &line_);
    socket_->send(line_);
    ++lines_;
    const HostStamp sent = monotonic_now();
    behind_pose_.add((sent - report.estimated).to_seconds() * 1e3);
    if (tie) age_.add((tie->stamp_at(sent) - pose.stamp).to_seconds() * 1e3);
  }

  void send_status(HostStamp now) {
    status_due_ = now + kBetweenStatus;
    StreamStatus status{.session = start_.name, .frame = newest_};
    if (newest_) status.silent_s = (now - newest_->estimated).to_seconds();
    status.calibrated = !calibration_line_.empty();
    status.verified = verified_;
    status.aligned = alignment_.has_value();
    status.dropped = dropped_;
    if (const std::int64_t ns = sample_ns_; ns != 0)
      status.ins = {fix_, (now - HostStamp(ns)).to_seconds()};
    socket_->send(status_line(status));
  }

  void send_images() {
    if (images_.ready()) {
      image_bytes_.clear();
      for (std::size_t k = 0; k < FrameImages::kImages; ++k)
        if (const ImageView image = images_.image(k); !image.empty()) {
          const auto& names = start_.camera_names;
          image_bytes_ += image_line(images_.frame(), images_.stamp(), static_cast<int>(k),
                                     k < names.size() ? names[k] : "", image);
          image_bytes_.append(reinterpret_cast<const char*>(image.data),
                              static_cast<std::size_t>(image.width * image.height));
        }
      socket_->send_images(image_bytes_);
      images_.done();
    }
    if (socket_->wants_images()) images_.want(start_.image_bytes);
  }

  [[nodiscard]] LineResponse answer(std::string_view request) {
    const auto parsed = nlohmann::json::parse(request, nullptr, false);
    const std::string name =
        parsed.is_object() && parsed.contains("request") && parsed["request"].is_string()
            ? parsed["request"].get<std::string>()
            : "";
    const auto refuse = [&name](std::string_view why) {
      return LineResponse{response_line(name, false, why)};
    };
    if (name != "recalibrate" && name != "images")
      return refuse(R"(unknown request; send {"request": "recalibrate"} or )"
                    R"({"request": "images", "rate_hz": 5})");
    if (!started_)
      return refuse("the session has not started yet; repeat the request after the first pose");
    if (name == "images") {
      constexpr double kMaxRate = 200;
      const double rate = parsed.value("rate_hz", nlohmann::json()).is_number()
                              ? parsed["rate_hz"].get<double>()
                              : 0;
      if (!(rate >= 0.01 && rate <= kMaxRate))
        return refuse("rate_hz is missing or outside 0.01 to 200");
      return {response_line(name, true, "images follow"), Duration::seconds(1 / rate)};
    }
    if (!start_.can_recalibrate)
      return refuse(
          "this session cannot be recalibrated on request; use a live session with "
          "calibration.online: on");
    requests_->recalibrate = true;
    return {response_line(name, true, "recalibration starts at the next frame"), {}};
  }

  void wake() noexcept { (void)::eventfd_write(wake_.get(), 1); }
  void stop() noexcept {
    stop_ = true;
    wake();
    if (thread_.joinable()) thread_.join();
  }

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

}  // namespace

std::unique_ptr<SessionObserver> make_line_publisher(
    std::unique_ptr<LineSocket> socket, SessionRequests* requests,
    const calibration::CalibrationOptions& options) {
  return std::make_unique<LinePublisher>(std::move(socket), requests, options);
}

}  // namespace vergence::app
