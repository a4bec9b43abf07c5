#include <bit>
#include <chrono>
#include <tuple>

#include "drivers/clock.hpp"
#include "tests/support/detail/gige_camera_impl.hpp"

/// The simulated camera's exposures: when, with what in them, and what becomes of them.
namespace vergence::test {
namespace {

using namespace gige_register;
using namespace gvcp;

constexpr std::size_t kLatchedPulses = 256;  // exposed one after the other, stamped with their own
                                             // time: a busy machine's delays are none
// Numbers of chunks.
constexpr std::uint32_t kImageChunk = 0xA5A50001, kExposureChunk = 0xA5A50002,
                        kTimestampChunk = 0xA5A50003;

}  // namespace

void GigeCamera::Impl::pulse(std::uint64_t number, std::uint32_t source, HostStamp when) {
  const std::lock_guard lock(mutex_);
  if (!acquiring_ || !powered_ || word(trigger_mode) == 0 || word(trigger_source) != source ||
      pulses_.size() >= kLatchedPulses)
    return;
  pulses_.emplace_back(number, when.ns() != 0 ? when : monotonic_now());
  changed_.notify_all();
}

GvspFrame GigeCamera::Impl::make_frame(std::uint64_t number, HostStamp when) {
  GvspFrame f;
  f.number = number;
  f.block = block_++;
  if (!options.extended_ids && block_ > 0xFFFFU) block_ = 1;
  f.ticks = ticks(when);
  f.pixel_format = word(pixel_format);
  f.width = static_cast<int>(word(width));
  f.height = static_cast<int>(word(height));
  f.offset_x = static_cast<int>(word(offset_x));
  f.offset_y = static_cast<int>(word(offset_y));
  if (lie_width_ > 0) {
    f.width = lie_width_;
    f.height = lie_height_;
  }
  const std::size_t bytes = static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height) *
                            (f.pixel_format >> 16U & 0xFFU) / 8;
  const std::uint8_t* given = options.images ? options.images(number) : nullptr;
  if (given != nullptr) {
    f.pixels.assign(given, given + bytes);
  } else {
    f.pixels.assign(bytes, static_cast<std::uint8_t>(31 * number));  // every byte tells its image
  }
  if (options.number_images)
    for (std::size_t i = 0; i < 8; ++i) f.pixels[i] = static_cast<std::uint8_t>(number >> (8 * i));
  if (word(chunk_mode) != 0) append_chunks(&f);
  return f;
}

/// Precondition: mutex_ held, the exposure is known.
void GigeCamera::Impl::append_chunks(GvspFrame* f) {
  f->payload_type = options.chunk_payload;
  const std::size_t pixels = f->pixels.size();
  Wire w;
  w.u32(kImageChunk).u32(static_cast<std::uint32_t>(pixels));
  if (has_chunk(kSelectTimestamp)) w.u64(f->ticks).u32(kTimestampChunk).u32(8);
  if (has_chunk(kSelectExposure)) {
    const double us = exposed_[f->number];
    if (options.old_names) {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(us));  // little endian
      for (std::uint32_t i = 0; i < 4; ++i) w.u8(bits >> (8 * i) & 0xFFU);
    } else {
      w.u64(std::bit_cast<std::uint64_t>(us));
    }
    w.u32(kExposureChunk).u32(exposure_bytes());
  }
  f->pixels.insert(f->pixels.end(), w.bytes().begin(), w.bytes().end());
  if (garble_ > 0) {
    --garble_;
    std::uint32_t noise = static_cast<std::uint32_t>(f->number) * 2654435761U;
    for (std::size_t i = pixels; i < f->pixels.size(); ++i) {
      noise = noise * 1664525U + 1013904223U;
      f->pixels[i] = static_cast<std::uint8_t>(noise >> 24U);
    }
  }
}

/// µs, as the wire has it. Precondition: mutex_ held.
double GigeCamera::Impl::exposure_of(std::uint64_t number) const {
  const auto set = static_cast<double>(real(exposure_time));
  const double us = options.exposures ? options.exposures(number, set) : set;
  return options.old_names ? static_cast<double>(static_cast<float>(us)) : us;
}

void GigeCamera::Impl::expose() {
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
    const double us = exposure_of(number);
    exposed_[number] = us;
    lock.unlock();
    sleep_until(when + Duration::seconds(us * 1e-6));
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
      fate = GvspSender::Fate::torn;
    }
    lock.unlock();
    sender.send(std::move(frame), fate);
    lock.lock();
  }
}

}  // namespace vergence::test
