#include <algorithm>
#include <exception>
#include <memory>

#include "drivers/clock.hpp"
#include "drivers/gige/detail/gige_camera.hpp"

/// The half of a camera that watches it, and brings it back.
namespace vergence::gige {
namespace {

constexpr Duration kTick = Duration::milliseconds(100);
constexpr Duration kLeastSilence =
    Duration::seconds(1);  // of a free running camera before it is taken for gone
constexpr Duration kAskEvery =
    Duration::seconds(1);  // a triggered one may rest; it is asked whether it is there
constexpr Duration kFirstPause = Duration::milliseconds(500),
                   kLongestPause = Duration::seconds(5);  // between attempts to reopen
constexpr int kWrongSizes = 3;                            // in a row: no accident

}  // namespace

/// What one round of the supervisor leaves for the next.
struct GigeCamera::Watch {
  Duration pause = kFirstPause;
  HostStamp next_try{}, asked = monotonic_now();
};

void GigeCamera::start_supervising() {
  supervisor_.start("vergence-watch", kTick,
                    [this, watch = std::make_shared<Watch>()] { supervise(watch.get()); });
}

void GigeCamera::supervise(Watch* watch) {
  try {
    switch (queue_.state()) {
      case FrameQueue::State::streaming:
        watch->pause = kFirstPause;
        watch->next_try = monotonic_now() + watch->pause;
        if (const Fault fault = check(monotonic_now(), &watch->asked); !fault.reason.empty())
          lose(fault);
        break;
      case FrameQueue::State::gone:
        if (monotonic_now() < watch->next_try) break;
        if (reopen()) queue_.ready_again();
        watch->pause = std::min(watch->pause * 2, kLongestPause);
        watch->next_try = monotonic_now() + watch->pause;
        break;
      case FrameQueue::State::back:
        queue_.ready_again();
        break;
      case FrameQueue::State::stopped:
        break;
    }
  } catch (const std::exception&) {  // no memory for a sentence: the next round tries again
  }
}

GigeCamera::Fault GigeCamera::check(HostStamp at, HostStamp* asked) {
  static const Fault kSilent{"the camera does not answer any more", false};
  if (receiver_.wrong_sizes() >= kWrongSizes)
    return {"the camera sends " +
            (receiver_.wrong_width() > 0
                 ? size_text(receiver_.wrong_width(), receiver_.wrong_height())
                 : "images without their size") +
            " where " + size_text(requested_.width, requested_.height) +
            " was configured; power it off and on"};
  const std::lock_guard lock(device_);
  if (session_ == nullptr || queue_.state() != FrameQueue::State::streaming) return {};
  if (session_->lost()) return kSilent;
  const Duration silence = at - receiver_.last_buffer();
  const Duration period = Duration::seconds(1 / requested_.rate_hz);
  if (requested_.trigger == CameraTrigger::free && silence > std::max(kLeastSilence, period * 10)) {
    if (!session_->in_control()) return kSilent;
    return {"the camera answers, but sends no images; check the firewall, and the MTU on the way"};
  }
  if (requested_.trigger != CameraTrigger::free && silence > std::max(kAskEvery, period * 3) &&
      at - *asked > kAskEvery) {
    *asked = at;
    if (!session_->in_control()) return kSilent;
  }
  return {};
}

void GigeCamera::lose(const Fault& fault) {
  last_error_.set(fault.reason);
  queue_.lose(monotonic_now());
  const std::lock_guard lock(device_);
  close_stream(fault.reachable);
  session_.reset();
}

bool GigeCamera::reopen() {
  const std::lock_guard lock(device_);
  std::string why;
  session_ = open_ours(address_, &why);
  // With another address, perhaps, whoever has the old one now: nobody, or another camera.
  if (session_ == nullptr && !info_.serial.empty() && !supervisor_.stopping())
    for (const Found& f : discover())
      if (f.info.serial == info_.serial && session_ == nullptr)
        session_ = open_ours(f.info.place, &why);
  if (session_ == nullptr || supervisor_.stopping()) return false;
  address_ = session_->info().place;
  if (apply_again() == DeviceStatus::ok) return true;
  session_.reset();
  return false;
}

}  // namespace vergence::gige
