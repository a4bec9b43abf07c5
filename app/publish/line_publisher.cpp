#include "app/publish/line_publisher.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include "drivers/clock.hpp"

namespace vergence::app {
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
