#include "app/publish/line_publisher.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "drivers/clock.hpp"

namespace vergence::app {

namespace {

/// JSON knows no infinity.
void write_number(double value, int digits, std::string* line) {
  if (std::isfinite(value))
    fmt::format_to(std::back_inserter(*line), "{:.{}f}", value, digits);
  else
    *line += "null";
}

void write_covariance(const char* key, const Covariance6& covariance, std::string* line) {
  fmt::format_to(std::back_inserter(*line), R"(,"{}":[{:.4g})", key, covariance[0]);
  for (std::size_t i = 1; i < covariance.size(); ++i)
    fmt::format_to(std::back_inserter(*line), ",{:.4g}", covariance[i]);
  *line += ']';
}

bool finite(const Covariance6& covariance) {
  return std::all_of(covariance.begin(), covariance.end(),
                     [](float c) { return std::isfinite(c); });
}

void write_covariances(const PoseSample& pose, std::string* line) {
  if (pose.status == PoseStatus::lost || !finite(pose.covariance) ||
      !finite(pose.motion_covariance) || !std::isfinite(pose.length_sigma)) {
    *line += R"(,"covariance":null,"motion_covariance":null,"length_sigma":null)";
    return;
  }
  write_covariance("covariance", pose.covariance, line);
  write_covariance("motion_covariance", pose.motion_covariance, line);
  fmt::format_to(std::back_inserter(*line), R"(,"length_sigma":{:.5f})", pose.length_sigma);
}

}  // namespace

EarthPose PublishedPlacement::of(const Transform& T_world_left) const {
  const Transform T_enu_left = T_enu_world * T_world_left;
  const Vec3 view = T_enu_left.R.col(2);
  return {T_enu_left, LocalTangentPlane(origin).to_geodetic(T_enu_left.t),
          std::atan2(view.y(), view.x())};
}

void write_pose_line(const PoseSample& pose, const std::optional<EarthPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line) {
  line->clear();
  auto out = std::back_inserter(*line);
  fmt::format_to(out, R"({{"version":1,"frame":{},"stamp_ns":{},"state":"{}","status":"{}",)",
                 pose.frame, pose.stamp.ns(), to_string(pose.state), to_string(pose.status));
  fmt::format_to(out, R"("reason":"{}","pose":)", to_string(pose.reason));
  if (pose.status == PoseStatus::lost || !pose.T_world_left.R.allFinite() ||
      !pose.T_world_left.t.allFinite()) {
    *line += "null";
  } else {
    const Vec3& t = pose.T_world_left.t;
    const Eigen::Quaterniond q = quaternion(pose.T_world_left.R);
    fmt::format_to(
        out,
        R"({{"position_m":[{:.6f},{:.6f},{:.6f}],"orientation_xyzw":[{:.9f},{:.9f},{:.9f},{:.9f}]}})",
        t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  write_covariances(pose, line);
  *line += R"(,"earth":)";
  if (pose.status == PoseStatus::lost || !earth) {
    *line += "null";
  } else {
    fmt::format_to(out, R"({{"enu_m":[{:.4f},{:.4f},{:.4f}],"latitude_deg":{:.9f},)",
                   earth->T_enu_left.t.x(), earth->T_enu_left.t.y(), earth->T_enu_left.t.z(),
                   earth->position.latitude_deg);
    fmt::format_to(out, R"("longitude_deg":{:.9f},"height_m":{:.4f},"heading_deg":{:.4f}}})",
                   earth->position.longitude_deg, earth->position.height_m,
                   compass_heading_deg(earth->yaw));
  }
  fmt::format_to(out, R"(,"inliers":{},"stereo_inliers":{},"reprojection_px":)", pose.inliers,
                 pose.stereo_inliers);
  write_number(pose.reprojection_px, 4, line);
  *line += R"(,"estimate_ms":)";
  write_number(static_cast<double>(pose.estimate_ms), 3, line);
  *line += R"(,"age_ms":)";
  write_number(age_ms.value_or(std::numeric_limits<double>::quiet_NaN()), 3, line);
  fmt::format_to(out, ",\"dropped\":{}}}\n", dropped);
}

namespace {

constexpr int kNiceness = -10;

}  // namespace

LinePublisher::LinePublisher(std::unique_ptr<LineSocket> socket)
    : socket_(std::move(socket)), thread_([this] { work(); }) {}

LinePublisher::~LinePublisher() { stop(); }

void LinePublisher::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_.signal();
  if (thread_.joinable()) thread_.join();
}

void LinePublisher::on_pose(const PoseSample& sample) noexcept {
  if (!poses_.push({sample, monotonic_now()})) dropped_.fetch_add(1, std::memory_order_relaxed);
  wake_.signal();
}

void LinePublisher::on_placement(const Placement& placement, const Geodetic& origin) noexcept {
  // Eight that wait are more than a session has in its first minutes; the newest is then lost
  // until the next one.
  (void)placements_.push({placement.T_enu_world, origin});
}

void LinePublisher::work() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-lines");
  // A tenth of a percent of a core, for which somebody waits: before other work, where the system
  // lets us.
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNiceness);
  for (;;) {
    const WakeEvent::Ticket seen = wake_.ticket();
    const bool last = stop_.load(std::memory_order_acquire);
    for (Outgoing pose; poses_.pop(&pose);) send(pose);
    if (last) return;
    wake_.wait(seen);
  }
}

void LinePublisher::send(const Outgoing& outgoing) {
  const PoseSample& pose = outgoing.pose;
  for (PublishedPlacement placement; placements_.pop(&placement);) placement_ = placement;
  std::optional<EarthPose> on_earth;
  if (placement_ && pose.status != PoseStatus::lost) on_earth = placement_->of(pose.T_world_left);
  const HostStamp now = monotonic_now();
  std::optional<double> age_ms;
  if (tie_) age_ms = (tie_->stamp_at(now) - pose.stamp).to_seconds() * 1e3;
  write_pose_line(pose, on_earth, age_ms, dropped_.load(std::memory_order_relaxed), &line_);
  socket_->send(line_);
  ++lines_;
  const HostStamp sent = monotonic_now();
  behind_pose_.add((sent - outgoing.out).to_seconds() * 1e3);
  if (!tie_) return;
  age_.add((tie_->stamp_at(sent) - pose.stamp).to_seconds() * 1e3);
  constexpr std::uint64_t kBetween = 64;  // lines: a percentile walks through thousands of bins
  if (lines_ % kBetween == 1) age_p99_ms_.store(age_.percentile(0.99), std::memory_order_relaxed);
}

std::vector<std::pair<std::string, std::uint64_t>> LinePublisher::counters() {
  stop();
  const LineSocketCounters c = socket_->counters();
  const auto us = [](double ms) { return static_cast<std::uint64_t>(ms * 1e3 + 0.5); };
  std::vector<std::pair<std::string, std::uint64_t>> out{
      {"lines", lines_},
      {"lines_dropped", dropped_.load(std::memory_order_relaxed)},
      {"lines_sent", c.sent},
      {"lines_refused", c.refused},
      {"line_readers", c.readers},
      {"line_readers_closed", c.closed},
      {"line_readers_turned_away", c.turned_away},
      {"line_behind_pose_p50_us", us(behind_pose_.percentile(0.5))},
      {"line_behind_pose_p99_us", us(behind_pose_.percentile(0.99))}};
  if (tie_)
    out.insert(out.end(), {{"line_age_p50_us", us(age_.percentile(0.5))},
                           {"line_age_p99_us", us(age_.percentile(0.99))}});
  return out;
}

}  // namespace vergence::app
