#include "drivers/common/side_by_side_camera.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <string>

namespace vergence {
namespace {

constexpr std::array<const char*, 2> kHalf{"left", "right"};

/// The camera behind both halves. It receives the camera's notifications.
class Whole final : public Notifier {
 public:
  explicit Whole(std::unique_ptr<CameraDevice> camera) : camera_(std::move(camera)) {}

  [[nodiscard]] const CameraDevice& camera() const noexcept { return *camera_; }

  DeviceStatus configure(std::size_t half, const CameraConfiguration& requested,
                         CameraConfiguration* actual, std::string* error) noexcept {
    const std::lock_guard lock(mutex_);
    const std::optional<Size>& other = sizes_[1 - half];
    const Size size{requested.width, requested.height};
    if (other && size != *other) {
      *error = "both images come in one frame, and the other image is " +
               std::to_string(other->width) + " x " + std::to_string(other->height) +
               "; set one size for both";
      return DeviceStatus::bad_configuration;
    }
    if (held_ > 0) return DeviceStatus::busy;
    CameraConfiguration doubled = requested;
    doubled.width *= 2;
    CameraConfiguration made;
    const DeviceStatus status = camera_->configure(doubled, &made);
    if (status != DeviceStatus::ok) {
      *error = camera_->last_error();
      if (!error->empty()) *error += " (twice the width of one image: both are in one frame)";
      return status;
    }
    sizes_[half] = size;
    made.width = requested.width;
    if (actual != nullptr) *actual = made;
    return DeviceStatus::ok;
  }

  DeviceStatus start(std::size_t half, Notifier* ready, std::string* error) noexcept {
    const std::lock_guard lock(mutex_);
    if (!sizes_[half]) return DeviceStatus::bad_configuration;
    if (disconnected_ && !noticed_[1 - half]) return DeviceStatus::disconnected;
    ready_[half].store(ready, std::memory_order_release);
    const DeviceStatus status = camera_->start(this);
    if (status != DeviceStatus::ok) {
      *error = camera_->last_error();
      return status;
    }
    disconnected_ = false;
    noticed_ = {};
    return DeviceStatus::ok;
  }

  DeviceStatus wait(std::size_t half, Duration limit, Frame* frame) noexcept {
    const auto end = std::chrono::steady_clock::now() + std::chrono::nanoseconds(limit.ns());
    const std::lock_guard fetching(fetching_);
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (pop(half, frame)) return DeviceStatus::ok;
        if (disconnected_) return notice(half, frame);
      }
      const auto left = Duration::nanoseconds((end - std::chrono::steady_clock::now()).count());
      Frame next;
      const DeviceStatus status = camera_->wait(std::max(left, Duration{}), &next);
      if (status != DeviceStatus::ok && status != DeviceStatus::disconnected) return status;
      const std::lock_guard lock(mutex_);
      if (status == DeviceStatus::ok) {
        queue(next);
      } else {
        disconnected_ = true;
        disconnected_at_ = next.arrival;
      }
    }
  }

  [[nodiscard]] ImageView view(std::size_t half, FrameSlot slot) const noexcept {
    ImageView view = camera_->view(slot);
    view.width /= 2;
    view.data += half == 0 ? 0 : view.width;
    return view;
  }

  void release(FrameSlot slot) noexcept {
    const std::lock_guard lock(mutex_);
    release_locked(slot);
  }

  void stop() noexcept {
    // Wakes the thread that waits.
    camera_->stop();
    const std::lock_guard fetching(fetching_);
    const std::lock_guard lock(mutex_);
    for (Waiting& w : waiting_)
      for (; w.count > 0; --w.count, w.first = (w.first + 1) % w.frames.size())
        release_locked(w.frames[w.first].slot);
    disconnected_ = false;
    noticed_ = {};
    for (auto& ready : ready_) ready.store(nullptr, std::memory_order_release);
  }

  DeviceStatus set_exposure(const ExposureSetting& requested, ExposureSetting* actual) noexcept {
    return camera_->set_exposure(requested, actual);
  }
  DeviceStatus trigger_once() noexcept { return camera_->trigger_once(); }

  [[nodiscard]] CameraStatistics statistics(std::size_t half) const noexcept {
    CameraStatistics s = camera_->statistics();
    const std::lock_guard lock(mutex_);
    s.delivered = waiting_[half].delivered;
    s.incomplete = waiting_[half].incomplete;
    return s;
  }

 private:
  struct Size {
    int width = 0, height = 0;
    bool operator==(const Size&) const = default;
  };
  /// Frames that one half has not yet handed out.
  struct Waiting {
    std::array<Frame, FramePool::kMaxSlots> frames{};
    std::size_t first = 0, count = 0;
    std::uint64_t delivered = 0, incomplete = 0;
  };
  void notify() noexcept override {
    for (std::size_t half = 0; half < ready_.size(); ++half) {
      Notifier* ready = ready_[half].load(std::memory_order_acquire);
      if (ready == nullptr) continue;
      if (half == 1 && ready == ready_[0].load(std::memory_order_acquire)) continue;
      ready->notify();
    }
  }

  bool pop(std::size_t half, Frame* frame) noexcept {
    Waiting& w = waiting_[half];
    if (w.count == 0) return false;
    *frame = w.frames[w.first];
    w.first = (w.first + 1) % w.frames.size();
    --w.count;
    ++w.delivered;
    if (frame->status == FrameStatus::incomplete) ++w.incomplete;
    return true;
  }

  /// Never overflows: a slot is queued at most once, and there are kMaxSlots places.
  void queue(const Frame& frame) noexcept {
    for (Waiting& w : waiting_) {
      w.frames[(w.first + w.count) % w.frames.size()] = frame;
      ++w.count;
    }
    users_[frame.slot] = 2;
    ++held_;
  }

  DeviceStatus notice(std::size_t half, Frame* frame) noexcept {
    noticed_[half] = true;
    frame->arrival = disconnected_at_;
    return DeviceStatus::disconnected;
  }

  void release_locked(FrameSlot slot) noexcept {
    if (--users_[slot] > 0) return;
    --held_;
    camera_->release(slot);
  }

  std::unique_ptr<CameraDevice> camera_;
  std::array<std::atomic<Notifier*>, 2> ready_{};

  // Held while waiting for the camera's next frame; locked before mutex_.
  std::mutex fetching_;

  // Guards the members below; never held during a wait.
  mutable std::mutex mutex_;
  std::array<std::optional<Size>, 2> sizes_{};
  std::array<Waiting, 2> waiting_{};
  // Number of halves that hold a slot, indexed by slot.
  std::array<std::uint8_t, FramePool::kMaxSlots> users_{};
  // Number of slots held by the halves.
  std::size_t held_ = 0;
  bool disconnected_ = false;
  HostStamp disconnected_at_{};
  // True for a half that has reported the disconnect.
  std::array<bool, 2> noticed_{};
};

class Half final : public CameraDevice {
 public:
  Half(std::shared_ptr<Whole> whole, std::size_t half)
      : whole_(std::move(whole)), half_(half), info_(whole_->camera().info()) {
    info_.model += std::string(", ") + kHalf[half] + " half";
  }
  ~Half() override { whole_->stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration& requested,
                         CameraConfiguration* actual) noexcept override {
    last_error_.clear();
    return whole_->configure(half_, requested, actual, &last_error_);
  }
  DeviceTiming timing() const noexcept override { return whole_->camera().timing(); }
  DeviceStatus start(Notifier* ready) noexcept override {
    last_error_.clear();
    return whole_->start(half_, ready, &last_error_);
  }
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override {
    return whole_->wait(half_, limit, frame);
  }
  ImageView view(FrameSlot slot) const noexcept override { return whole_->view(half_, slot); }
  void release(FrameSlot slot) noexcept override { whole_->release(slot); }
  void stop() noexcept override { whole_->stop(); }
  DeviceStatus trigger_once() noexcept override {
    return half_ == 0 ? whole_->trigger_once() : DeviceStatus::ok;
  }
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override {
    return whole_->set_exposure(requested, actual);
  }
  std::string last_error() const override { return last_error_; }
  std::string remark() const override {
    return half_ == 0 ? whole_->camera().remark() : std::string();
  }
  CameraStatistics statistics() const noexcept override { return whole_->statistics(half_); }

 private:
  std::shared_ptr<Whole> whole_;
  std::size_t half_;
  DeviceInfo info_;
  std::string last_error_;
};

}  // namespace

std::pair<std::unique_ptr<CameraDevice>, std::unique_ptr<CameraDevice>> split_side_by_side(
    std::unique_ptr<CameraDevice> camera) {
  const auto whole = std::make_shared<Whole>(std::move(camera));
  return {std::make_unique<Half>(whole, 0), std::make_unique<Half>(whole, 1)};
}

}  // namespace vergence
