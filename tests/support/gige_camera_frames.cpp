#include <chrono>
#include <tuple>

#include "drivers/clock.hpp"
#include "tests/support/detail/gvcp.hpp"
#include "tests/support/gige_camera.hpp"

/// The simulated camera's exposures: when, with what in them, and what becomes of them.
namespace vergence::test {
namespace {

using namespace gige_register;
using namespace gvcp;

/// Exposed one after the other, stamped with their own time: a busy machine's delays are none.
constexpr std::size_t kLatchedPulses = 256;
}  // namespace

void GigeCamera::pulse(std::uint64_t number, HostStamp when) {
  const std::lock_guard lock(mutex_);
  if (!acquiring_ || !powered_ || word(trigger_mode) == 0 || word(trigger_source) != 1 ||
      pulses_.size() >= kLatchedPulses)
    return;
  pulses_.emplace_back(number, when.ns() != 0 ? when : monotonic_now());
  changed_.notify_all();
}

GvspFrame GigeCamera::make_frame(std::uint64_t number, HostStamp when) {
  GvspFrame f{.number = number, .block = block_++};
  if (!options_.extended_ids && block_ > 0xFFFFU) block_ = 1;
  f.ticks = ticks(when);
  f.pixel_format = word(pixel_format);
  f.width = lie_width_ > 0 ? lie_width_ : static_cast<int>(word(width));
  f.height = lie_width_ > 0 ? lie_height_ : static_cast<int>(word(height));
  f.offset_x = static_cast<int>(word(offset_x));
  f.offset_y = static_cast<int>(word(offset_y));
  const std::size_t bytes = static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height) *
                            (f.pixel_format >> 16U & 0xFFU) / 8;
  const std::uint8_t* given = options_.images ? options_.images(number) : nullptr;
  if (given != nullptr) {
    f.pixels.assign(given, given + bytes);
  } else {
    // Every byte tells its image.
    f.pixels.assign(bytes, static_cast<std::uint8_t>(31 * number));
  }
  if (options_.number_images)
    for (std::size_t i = 0; i < 8; ++i) f.pixels[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return f;
}

void GigeCamera::expose() {
  std::unique_lock lock(mutex_);
  HostStamp last{};
  for (;;) {
    if (quit_) return;
    const bool triggered = word(trigger_mode) != 0;
    if (!acquiring_ || !powered_ || silent_ || (triggered && pulses_.empty())) {
      (void)changed_.wait_for(lock, std::chrono::milliseconds(20));
      continue;
    }
    std::uint64_t number = 0;
    HostStamp when = monotonic_now();
    const Duration exposure = Duration::seconds(static_cast<double>(real(exposure_time)) * 1e-6);
    if (triggered) {
      std::tie(number, when) = pulses_.front();
    } else {
      const std::int64_t period =
          Duration::seconds(1.0 / static_cast<double>(real(frame_rate))).ns();
      number =
          static_cast<std::uint64_t>(std::max(when.ns() - exposure.ns(), last.ns()) / period + 1);
      when = HostStamp(static_cast<std::int64_t>(number) * period);
      last = when;
    }
    lock.unlock();
    sleep_until(when + exposure);
    lock.lock();
    if (triggered && !pulses_.empty()) pulses_.pop_front();
    if (!acquiring_ || !powered_ || silent_) continue;
    GvspFrame frame = make_frame(number, when);
    GvspSender::Fate fate = GvspSender::Fate::normal;
    if (lose_ > 0) {
      --lose_;
      fate = GvspSender::Fate::unsent;
    } else if (tear_ > 0) {
      --tear_;
      fate = GvspSender::Fate::incomplete;
    }
    lock.unlock();
    sender_.send(std::move(frame), fate);
    lock.lock();
  }
}

}  // namespace vergence::test
