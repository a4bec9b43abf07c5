#include "drivers/serial/byte_pipe.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "drivers/clock.hpp"

namespace vergence {
namespace {

/// One direction: a circle of bytes.
struct Channel {
  std::array<std::uint8_t, kPipeBytes> bytes{};
  std::size_t head = 0, size = 0;
  HostStamp newest{};    // when the last byte was written
  bool woken = false;    // its reader
  bool closed = false;   // its writer has gone
  bool refused = false;  // its reader has gone
};

struct Shared {
  std::mutex mutex;
  std::condition_variable changed;
  std::array<Channel, 2> channels{};
};

class PipeEnd final : public ByteLine {
 public:
  PipeEnd(std::shared_ptr<Shared> shared, std::size_t reads)
      : shared_(std::move(shared)), reads_(reads) {}
  PipeEnd(const PipeEnd&) = delete;
  PipeEnd& operator=(const PipeEnd&) = delete;
  ~PipeEnd() override {
    const std::lock_guard lock(shared_->mutex);
    in().refused = true;
    out().closed = true;
    shared_->changed.notify_all();
  }

  LineRead read(std::span<std::uint8_t> to, Duration limit) noexcept override {
    std::unique_lock lock(shared_->mutex);
    (void)shared_->changed.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                                    [this] { return in().size > 0 || in().closed || in().woken; });
    if (in().woken) {
      in().woken = false;
      return {DeviceStatus::stopped, 0, {}};
    }
    if (in().size == 0)
      return {in().closed ? DeviceStatus::gone : DeviceStatus::timeout, 0, monotonic_now()};
    const std::size_t n = std::min(to.size(), in().size);
    for (std::size_t i = 0; i < n; ++i) to[i] = in().bytes[(in().head + i) % kPipeBytes];
    in().head = (in().head + n) % kPipeBytes;
    in().size -= n;
    shared_->changed.notify_all();
    return {DeviceStatus::ok, n, in().newest};
  }

  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override {
    std::unique_lock lock(shared_->mutex);
    const auto fits = [&] { return out().refused || kPipeBytes - out().size >= bytes.size(); };
    if (!shared_->changed.wait_for(lock, std::chrono::nanoseconds(limit.ns()), fits))
      return DeviceStatus::timeout;
    if (out().refused) return DeviceStatus::gone;
    for (std::size_t i = 0; i < bytes.size(); ++i)
      out().bytes[(out().head + out().size + i) % kPipeBytes] = bytes[i];
    out().size += bytes.size();
    out().newest = monotonic_now();
    shared_->changed.notify_all();
    return DeviceStatus::ok;
  }

  DeviceStatus set_baud(std::uint32_t baud) noexcept override {
    baud_ = baud;
    discard_input();
    return DeviceStatus::ok;
  }
  std::uint32_t baud() const noexcept override { return baud_; }
  void discard_input() noexcept override {
    const std::lock_guard lock(shared_->mutex);
    in().size = 0;
    shared_->changed.notify_all();
  }
  void wake() noexcept override {
    const std::lock_guard lock(shared_->mutex);
    in().woken = true;
    shared_->changed.notify_all();
  }
  HostStamp now() const noexcept override { return monotonic_now(); }

 private:
  Channel& in() noexcept { return shared_->channels[reads_]; }
  Channel& out() noexcept { return shared_->channels[1 - reads_]; }

  std::shared_ptr<Shared> shared_;
  std::size_t reads_;
  std::uint32_t baud_ = LineSettings{}.baud;
};

}  // namespace

std::pair<std::unique_ptr<ByteLine>, std::unique_ptr<ByteLine>> make_byte_pipe() {
  auto shared = std::make_shared<Shared>();
  return {std::make_unique<PipeEnd>(shared, 0), std::make_unique<PipeEnd>(shared, 1)};
}

}  // namespace vergence
