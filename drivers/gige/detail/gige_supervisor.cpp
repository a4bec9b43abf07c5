#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <exception>

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

void GigeCamera::supervise() {
  (void)pthread_setname_np(pthread_self(), "vergence-watch");
  Duration pause = kFirstPause;
  HostStamp next_try{}, asked = monotonic_now();
  for (std::unique_lock lock(supervisor_); !quit_;) {
    (void)wake_.wait_for(lock, std::chrono::nanoseconds(kTick.ns()), [this] { return quit_; });
    if (quit_) return;
    lock.unlock();
    try {
      switch (handover_.state()) {
        case Handover::State::streaming:
          pause = kFirstPause;
          next_try = monotonic_now() + pause;
          if (const Trouble trouble = what_is_wrong(monotonic_now(), &asked); !trouble.why.empty())
            lose(trouble);
          break;
        case Handover::State::gone:
          if (monotonic_now() < next_try) break;
          if (reopen()) handover_.ready_again();
          pause = std::min(pause * 2, kLongestPause);
          next_try = monotonic_now() + pause;
          break;
        case Handover::State::back:
          handover_.ready_again();
          break;
        case Handover::State::stopped:
          break;
      }
    } catch (const std::exception&) {  // no memory for a sentence: the next round tries again
    }
    lock.lock();
  }
}

GigeCamera::Trouble GigeCamera::what_is_wrong(HostStamp at, HostStamp* asked) {
  static const Trouble kSilent{"the camera does not answer any more", false};
  if (wrong_sizes_.load(std::memory_order_relaxed) >= kWrongSizes)
    return {"the camera sends " +
            (seen_width_ > 0 ? size_text(seen_width_, seen_height_) : "images without their size") +
            " where " + size_text(requested_.width, requested_.height) +
            " was configured; power it off and on"};
  const std::lock_guard lock(device_);
  if (session_ == nullptr || handover_.state() != Handover::State::streaming) return {};
  if (session_->lost()) return kSilent;
  const Duration silence = at - HostStamp(heard_ns_.load(std::memory_order_acquire));
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

void GigeCamera::lose(const Trouble& trouble) {
  (void)refuse(DeviceStatus::gone, trouble.why);
  handover_.lose(monotonic_now());
  const std::lock_guard lock(device_);
  if (session_ != nullptr) session_->close_stream(trouble.reachable);
  stream_ = nullptr;
  session_.reset();
}

bool GigeCamera::quitting() {
  const std::lock_guard lock(supervisor_);
  return quit_;
}

bool GigeCamera::reopen() {
  const std::lock_guard lock(device_);
  DeviceStatus status = DeviceStatus::ok;
  std::string why;
  session_ = Session::open(address_, &status, &why);
  if (session_ != nullptr && session_->info().serial != info_.serial) session_.reset();
  if (session_ == nullptr && status == DeviceStatus::not_found &&
      !quitting())  // with another address, perhaps
    for (const Found& f : discover())
      if (f.info.serial == info_.serial && session_ == nullptr)
        session_ = Session::open(f.info.place, &status, &why);
  if (session_ == nullptr || quitting()) return false;
  address_ = session_->info().place;
  if (apply_again() == DeviceStatus::ok) return true;
  session_.reset();
  return false;
}

}  // namespace vergence::gige
