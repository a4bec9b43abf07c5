#include "tests/unit/drivers/conformance/shadow_camera.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "drivers/clock.hpp"

namespace vergence::test {
namespace {

using std::chrono::steady_clock;

// Slack for a busy machine beyond any requested limit.
constexpr Duration kSlack = Duration::milliseconds(500);
// Maximum time from start() to the first frame: links are probed and sensors settle.
constexpr Duration kFirst = Duration::milliseconds(4000);

/// FNV-1a over the pixels, without the padding.
std::uint64_t checksum(const ImageView& view) noexcept {
  std::uint64_t h = 0xcbf29ce484222325U;
  for (int y = 0; y < view.height; ++y)
    for (const std::uint8_t *p = view.row(y), *end = p + view.width; p != end; ++p)
      h = (h ^ *p) * 0x100000001b3U;
  return h;
}

bool overlap(const ImageView& a, const ImageView& b) noexcept {
  return a.data < b.row(b.height - 1) + b.width && b.data < a.row(a.height - 1) + a.width;
}

}  // namespace

ShadowCamera::ShadowCamera(ConformanceRig* rig) : rig_(rig), camera_(rig->camera()) {
  EXPECT_FALSE(camera_.info().driver.empty());
  last_ = at_start_ = camera_.statistics();
  Frame frame;
  EXPECT_EQ(camera_.wait(Duration{}, &frame), DeviceStatus::stopped) << "never started";
  EXPECT_EQ(camera_.start(nullptr), DeviceStatus::bad_configuration) << "never configured";
}

ShadowCamera::~ShadowCamera() {
  stop();
  release_all();
}

void ShadowCamera::configure(const CameraConfiguration& requested) {
  CameraConfiguration actual;
  const DeviceStatus status = camera_.configure(requested, &actual);
  if (state_ == State::streaming || state_ == State::disconnected) {
    EXPECT_EQ(status, DeviceStatus::busy) << "configured while streaming";
    return;
  }
  if (holds()) {
    EXPECT_EQ(status, DeviceStatus::busy) << "configured with slots out";
    return;
  }
  ASSERT_EQ(status, DeviceStatus::ok) << camera_.last_error();
  EXPECT_EQ(actual.width, requested.width);
  EXPECT_EQ(actual.height, requested.height);
  EXPECT_EQ(actual.trigger, requested.trigger);
  now_ = requested;
  state_ = State::stopped;
  EXPECT_GE(camera_.timing().min_delay, Duration{});
  EXPECT_GT(camera_.timing().resolution, Duration{});
}

void ShadowCamera::refuse(const CameraConfiguration& nonsense) {
  CameraConfiguration actual = nonsense;
  const DeviceStatus status = camera_.configure(nonsense, &actual);
  if (state_ == State::streaming || state_ == State::disconnected) {
    EXPECT_NE(status, DeviceStatus::ok);
    return;
  }
  EXPECT_TRUE(status == DeviceStatus::unsupported || status == DeviceStatus::bad_configuration ||
              status == DeviceStatus::busy)
      << to_string(status) << " for " << nonsense.width << " x " << nonsense.height << " at "
      << nonsense.rate_hz << " Hz";
  EXPECT_EQ(actual.width, nonsense.width) << "refused, and *actual written";
  if (status == DeviceStatus::unsupported && camera_.info().driver != "mock") {
    EXPECT_FALSE(camera_.last_error().empty()) << "what the camera offers is not said";
  }
}

void ShadowCamera::start() {
  const DeviceStatus status = camera_.start(&notifier_);
  if (state_ == State::unconfigured) {
    EXPECT_EQ(status, DeviceStatus::bad_configuration);
    return;
  }
  // Only unplug_and_replug() reconnects the camera.
  if (state_ == State::disconnected) return;
  ASSERT_EQ(status, DeviceStatus::ok) << camera_.last_error();
  if (state_ == State::streaming) return;
  state_ = State::streaming;
  ++starts_;
  any_ = false;
  gaps_ = 0;
  at_start_ = last_;
  rig_->started();
}

void ShadowCamera::stop() {
  camera_.stop();
  const std::uint64_t reported = notifier_.reported();
  if (state_ != State::unconfigured) state_ = State::stopped;
  Frame frame;
  EXPECT_EQ(camera_.wait(Duration::milliseconds(5), &frame), DeviceStatus::stopped);
  camera_.stop();
  EXPECT_EQ(notifier_.reported(), reported) << "reported after stop() returned";
}

void ShadowCamera::trigger_if_asked() {
  if (now_.trigger != CameraTrigger::software || state_ != State::streaming) return;
  const DeviceStatus status = camera_.trigger_once();
  EXPECT_TRUE(status == DeviceStatus::ok || (unplugged_ && status == DeviceStatus::disconnected))
      << to_string(status) << camera_.last_error();
}

DeviceStatus ShadowCamera::wait(Duration limit) {
  trigger_if_asked();
  Frame frame{.slot = 0xFFFF};
  const auto begin = steady_clock::now();
  const DeviceStatus status = camera_.wait(limit, &frame);
  const auto took = Duration::nanoseconds((steady_clock::now() - begin).count());
  EXPECT_LE(took, limit + kSlack) << "waited " << took.to_seconds() << " s for a limit of "
                                  << limit.to_seconds();
  switch (status) {
    case DeviceStatus::ok:
      EXPECT_TRUE(state_ == State::streaming) << "a frame while not streaming";
      check(frame);
      break;
    case DeviceStatus::timeout:
      EXPECT_TRUE(state_ == State::streaming);
      EXPECT_EQ(frame.slot, 0xFFFF) << "no frame, and *frame written";
      EXPECT_GE(took + Duration::milliseconds(1), limit) << "gave up early";
      break;
    case DeviceStatus::stopped:
      EXPECT_TRUE(state_ == State::unconfigured || state_ == State::stopped);
      break;
    case DeviceStatus::disconnected:
      EXPECT_TRUE(unplugged_) << "disconnected with the cable in: " << camera_.last_error();
      if (state_ == State::streaming) {
        EXPECT_LE(frame.arrival, monotonic_now());
        EXPECT_GT(frame.arrival.ns(), 0) << "when it went is not said";
      }
      state_ = State::disconnected;
      break;
    default:
      ADD_FAILURE() << "wait() → " << to_string(status);
  }
  return status;
}

void ShadowCamera::check(const Frame& frame) {
  ++delivered_;
  const bool incomplete = frame.status != FrameStatus::complete;
  if (incomplete) ++incomplete_;
  const ImageView view = camera_.view(frame.slot);
  ASSERT_FALSE(view.empty());
  EXPECT_EQ(view.width, now_.width);
  EXPECT_EQ(view.height, now_.height);
  EXPECT_GE(view.stride, view.width);
  for (const Held& h : held_) {
    EXPECT_NE(h.frame.slot, frame.slot) << "handed out twice";
    EXPECT_FALSE(overlap(h.view, view)) << "two slots share pixels";
  }
  EXPECT_LE(frame.arrival, monotonic_now());
  EXPECT_GT(frame.exposure, Duration{});
  if (any_) {
    EXPECT_GT(frame.counter, newest_.counter) << "counters go up";
    if (!incomplete && newest_.status == FrameStatus::complete) {
      EXPECT_GT(frame.exposure_start, newest_.exposure_start) << "stamps go up";
    }
    EXPECT_GE(frame.arrival, newest_.arrival);
    gaps_ += frame.counter - newest_.counter - 1;
  } else if (rig_->counts_from_start()) {
    gaps_ += frame.counter;
  }
  const CameraStatistics s = camera_.statistics();
  const std::uint64_t missing = s.lost + s.underruns - at_start_.lost - at_start_.underruns;
  EXPECT_LE(gaps_, missing) << "frame " << frame.counter << ": a gap that no counter tells";
  any_ = true;
  newest_ = frame;
  if (!incomplete) {
    EXPECT_TRUE(rig_->content_fits(frame, view))
        << "frame " << frame.counter << " has another one's pixels";
  }
  held_.push_back({frame, view, checksum(view)});
}

void ShadowCamera::release(std::size_t which) {
  const Held h = held_[which];
  EXPECT_EQ(checksum(h.view), h.sum)
      << "frame " << h.frame.counter << " was written to while it was ours";
  held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(which));
  camera_.release(h.frame.slot);
}

void ShadowCamera::release_all() {
  while (holds()) release(held_.size() - 1);
}

void ShadowCamera::expect_frames(int count) {
  const auto deadline = steady_clock::now() + std::chrono::nanoseconds(kFirst.ns());
  for (int got = 0; got < count && !::testing::Test::HasFatalFailure();) {
    ASSERT_LT(steady_clock::now(), deadline)
        << got << " of " << count << " frames came: " << camera_.last_error();
    release_all();
    if (wait(Duration::milliseconds(200)) == DeviceStatus::ok) ++got;
  }
}

bool ShadowCamera::unplug_and_replug() {
  if (state_ != State::streaming || !rig_->unplug()) return false;
  unplugged_ = true;
  const auto soon = [this] {
    return steady_clock::now() + std::chrono::nanoseconds(rig_->disconnected_within().ns());
  };
  // Frames in transit still arrive.
  for (const auto deadline = soon(); state_ != State::disconnected;) {
    if (steady_clock::now() > deadline) {
      ADD_FAILURE() << "unplugged, and not disconnected";
      return true;
    }
    release_all();
    (void)wait(Duration::milliseconds(100));
  }
  EXPECT_EQ(wait(Duration::milliseconds(50)), DeviceStatus::disconnected)
      << "disconnected stays disconnected";
  EXPECT_EQ(camera_.start(&notifier_), DeviceStatus::disconnected) << "started without a cable";
  rig_->replug();
  for (const auto deadline = soon();;) {
    const DeviceStatus status = camera_.start(&notifier_);
    if (status == DeviceStatus::ok) break;
    EXPECT_EQ(status, DeviceStatus::disconnected);
    if (steady_clock::now() > deadline) {
      ADD_FAILURE() << "plugged in again, and not back: " << camera_.last_error();
      return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  unplugged_ = false;
  state_ = State::streaming;
  ++starts_;
  any_ = false;
  gaps_ = 0;
  at_start_ = camera_.statistics();
  rig_->started();
  return true;
}

void ShadowCamera::check_statistics() {
  const CameraStatistics s = camera_.statistics();
  EXPECT_EQ(s.delivered, delivered_);
  EXPECT_EQ(s.incomplete, incomplete_);
  EXPECT_EQ(s.starts, starts_);
  EXPECT_GE(s.underruns, last_.underruns);
  EXPECT_GE(s.lost, last_.lost);
  last_ = s;
}

}  // namespace vergence::test
