#include "drivers/mock/mock_rig.hpp"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <optional>
#include <queue>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/mock/stream.hpp"

namespace vergence::mock {
namespace {

constexpr HostStamp kVirtualStart{1'000'000'000'000};  // 1000 s after a machine's start, on every run
constexpr Duration kNominalExposure = Duration::milliseconds(8);
constexpr Duration kTransfer = Duration::milliseconds(5);       // of an image over its bus
constexpr Duration kInsLatency = Duration::milliseconds(4);     // filter and serial line
constexpr Duration kReportLatency = Duration::milliseconds(1);  // of a pulse
constexpr Duration kJitterMean = Duration::microseconds(150);
constexpr Duration kJitterMost = Duration::microseconds(1900);  // below DeviceTiming::delay_spread
constexpr std::size_t kInsRing = 1024, kPulseRing = 64;

HostStamp monotonic_now() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return HostStamp(static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec);
}

/// Seeds that differ in their low bits only give streams that have nothing in common.
std::uint64_t mixed(std::uint64_t a, std::uint64_t b) noexcept {  // SplitMix64's finaliser
  std::uint64_t z = a + 0x9e3779b97f4a7c15U * (b + 1);
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

/// A crystal: reads the host's time with an offset and a drift, in whole microseconds; may be set by a fault.
struct DeviceOscillator {
  std::int64_t offset = 0;  // ns
  double drift = 0;
  int owner = -1;  // as Fault::camera

  [[nodiscard]] DeviceStamp read(HostStamp host, Duration drive_time, const std::vector<Fault>& faults) const noexcept {
    std::int64_t ns = host.ns() + offset + std::llround(drift * static_cast<double>(host.ns()));
    for (const Fault& f : faults)
      if (f.kind == FaultKind::time_jump && f.camera == owner && drive_time >= f.at) ns += std::llround(f.jump * 1e9);
    return DeviceStamp(ns / 1000 * 1000);
  }
};

DeviceOscillator oscillator(std::uint64_t seed, int owner, double drift_ppm) noexcept {
  Random random(mixed(seed, static_cast<std::uint64_t>(owner) + 10));
  return {std::llround(random.uniform(1e9, 1e12)), drift_ppm * 1e-6 * random.uniform(-1, 1), owner};
}

}  // namespace

class MockRig::Impl {
 public:
  Impl(std::shared_ptr<const RigTruth> truth, const MockRigOptions& options);
  ~Impl() { halt(); }

  class MockCamera;
  class MockIns;
  class MockTrigger;

  std::shared_ptr<const RigTruth> truth;
  MockRigOptions options;
  std::vector<std::unique_ptr<MockCamera>> cameras;
  std::unique_ptr<MockIns> ins;
  std::unique_ptr<MockTrigger> trigger;

  void begin(double rate_hz);
  void halt() noexcept;
  /// A consumer has made room.
  void freed() noexcept {
    freed_.fetch_add(1, std::memory_order_release);
    freed_.notify_all();
  }
  [[nodiscard]] HostStamp started() const noexcept { return start_; }
  [[nodiscard]] std::uint64_t pulses(double rate_hz) const noexcept {
    Duration length = truth->drive().duration();
    if (options.duration > Duration{}) length = std::min(length, options.duration);
    return static_cast<std::uint64_t>(length.to_seconds() * rate_hz) + 1;
  }

 private:
  /// One delivery on its way; `device`: camera, kInsDevice or kTriggerDevice.
  struct Parcel {
    HostStamp arrival{};
    std::uint64_t order = 0;  // of making: breaks ties
    int device = 0;
    Delivery<Frame> frame{};
    Delivery<InsReading> reading{};
    Delivery<Pulse> pulse{};
    [[nodiscard]] bool operator<(const Parcel& o) const noexcept {  // the queue's top is the earliest
      return std::pair(arrival, order) > std::pair(o.arrival, o.order);
    }
  };
  static constexpr int kInsDevice = -1, kTriggerDevice = -2;

  void produce();
  void hand_out_in_time();
  void make_frames(std::uint64_t pulse);
  void make_frame(std::uint64_t pulse, int k);
  void make_readings(HostStamp until);
  void post(Parcel parcel);
  void deliver_until(HostStamp horizon);
  void deliver(const Parcel& parcel, HostStamp arrival);
  void announce_end(HostStamp at);
  template <class S, class D>
  void push_or_wait(S* stream, const D& delivery);
  [[nodiscard]] std::optional<FrameSlot> slot_of(int k);
  [[nodiscard]] HostStamp jittered(HostStamp least, std::uint64_t device, std::uint64_t number) const noexcept;
  [[nodiscard]] HostStamp host_of(std::uint64_t pulse) const noexcept {
    return start_ + Duration::seconds(static_cast<double>(pulse) / rate_);
  }

  double rate_ = 0;
  HostStamp start_ = kVirtualStart;
  std::uint64_t readings_ = 0, orders_ = 0;
  std::mutex mutex_;  // of parcels_, in real time
  std::condition_variable posted_;
  std::priority_queue<Parcel> parcels_;
  bool finished_ = false;                                   // under mutex_: nothing more will be posted
  std::array<std::atomic<int>, kMaxCameras> on_the_way_{};  // frames in parcels_
  std::atomic<std::uint32_t> freed_{0};
  std::atomic<bool> stop_{false};
  std::thread producer_, deliverer_;
};

// ---- the devices --------------------------------------------------------------------------------------------------

class MockRig::Impl::MockCamera final : public CameraDevice {
 public:
  MockCamera(Impl* rig, int k)
      : rig_(rig),
        k_(k),
        info_{"mock", "mock-" + std::to_string(k), "rendered camera", "world"},
        clock_(oscillator(rig->options.seed, k, rig->options.clock_drift_ppm)) {}
  ~MockCamera() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }

  DeviceStatus configure(const CameraConfiguration& wanted, CameraConfiguration* actual) noexcept override {
    const Intrinsics& lens = rig_->truth->mounted().intrinsics[static_cast<std::size_t>(k_)];
    if (!(wanted.rate_hz > 0) || wanted.exposure <= Duration{} || wanted.exposure.to_seconds() * wanted.rate_hz > 1)
      return DeviceStatus::bad_configuration;
    if (wanted.width != lens.width || wanted.height != lens.height) return DeviceStatus::unsupported;
    if (stream.streaming()) return DeviceStatus::busy;
    try {
      arena_ = std::make_unique<Arena>(FramePool::memory_needed(lens.width, lens.height, kSlots) + kCacheLine);
      pool = std::make_unique<FramePool>(lens.width, lens.height, kSlots, *arena_);
      renderer = std::make_unique<Renderer>(rig_->truth->shared_world(), vergence::Camera(lens), rig_->options.pattern);
    } catch (const std::exception&) {
      return DeviceStatus::failed;
    }
    configuration = wanted;
    if (actual != nullptr) *actual = wanted;
    return DeviceStatus::ok;
  }
  DeviceTiming timing() const noexcept override { return {configuration.exposure + kTransfer}; }
  DeviceStatus start(Notifier* ready) noexcept override {
    if (pool == nullptr) return DeviceStatus::bad_configuration;
    const bool was = stream.streaming() && !gone_;
    const DeviceStatus status = stream.start(ready);
    if (status == DeviceStatus::ok && !was) {
      gone_ = false;
      starts_.fetch_add(1, std::memory_order_relaxed);
    }
    return status;
  }
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override {
    Delivery<Frame> d;
    const DeviceStatus status = stream.take(limit, &d);
    if (status == DeviceStatus::ok) {
      *frame = d.value;
      frame->arrival = d.arrival;
      delivered_.fetch_add(1, std::memory_order_relaxed);
      rig_->freed();
    } else if (status == DeviceStatus::gone) {
      if (!gone_) frame->arrival = d.arrival;
      gone_ = true;
    }
    return status;
  }
  ImageView view(FrameSlot slot) const noexcept override { return pool->view(slot); }
  void release(FrameSlot slot) noexcept override {
    pool->release(slot);
    rig_->freed();
  }
  void stop() noexcept override {
    stream.stop();
    rig_->freed();
  }
  CameraStatistics statistics() const noexcept override {
    return {delivered_.load(std::memory_order_relaxed), 0, underruns.load(std::memory_order_relaxed), lost.load(std::memory_order_relaxed),
            starts_.load(std::memory_order_relaxed)};
  }

  // The producer's side.
  Stream<Frame, 64> stream;
  std::unique_ptr<FramePool> pool;
  std::unique_ptr<Renderer> renderer;
  CameraConfiguration configuration{};
  std::atomic<std::uint64_t> underruns{0}, lost{0};
  bool unplugged = false;
  std::uint64_t counter_base = 0;
  [[nodiscard]] const DeviceOscillator& clock() const noexcept { return clock_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return arena_ ? arena_->capacity() : 0; }

 private:
  Impl* rig_;
  int k_;
  DeviceInfo info_;
  DeviceOscillator clock_;
  std::unique_ptr<Arena> arena_;
  std::atomic<std::uint64_t> delivered_{0}, starts_{0};
  bool gone_ = false;
};

class MockRig::Impl::MockIns final : public InsDevice {
 public:
  explicit MockIns(Impl* rig) : rig_(rig), clock_(oscillator(rig->options.seed, -1, rig->options.clock_drift_ppm)) {}
  ~MockIns() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override {
    if (!(rate_hz > 0)) return DeviceStatus::bad_configuration;
    if (rate_hz > 400) return DeviceStatus::unsupported;
    rate = rate_hz;
    model = std::make_unique<InsModel>(InsModelOptions{rig_->options.ideal_ins, mixed(rig_->options.seed, 99), rate_hz}, *rig_->truth);
    if (actual_hz != nullptr) *actual_hz = rate_hz;
    return DeviceStatus::ok;
  }
  DeviceTiming timing() const noexcept override { return {kInsLatency}; }
  DeviceStatus start(Notifier* ready) noexcept override {
    if (model == nullptr) return DeviceStatus::bad_configuration;
    return stream.start(ready);
  }
  DeviceStatus wait(Duration limit, InsReading* reading) noexcept override {
    Delivery<InsReading> d;
    const DeviceStatus status = stream.take(limit, &d);
    if (status != DeviceStatus::ok) return status;
    *reading = d.value;
    reading->arrival = d.arrival;
    delivered_.fetch_add(1, std::memory_order_relaxed);
    rig_->freed();
    return status;
  }
  void stop() noexcept override {
    stream.stop();
    rig_->freed();
  }
  InsStatistics statistics() const noexcept override {
    return {delivered_.load(std::memory_order_relaxed), lost.load(std::memory_order_relaxed), 0, overruns.load(std::memory_order_relaxed),
            1};
  }

  Stream<InsReading, kInsRing> stream;
  std::unique_ptr<InsModel> model;
  double rate = 0;
  std::atomic<std::uint64_t> lost{0}, overruns{0};
  [[nodiscard]] const DeviceOscillator& clock() const noexcept { return clock_; }

 private:
  Impl* rig_;
  DeviceInfo info_{"mock", "mock-ins", "simulated MTi-G", "world"};
  DeviceOscillator clock_;
  std::atomic<std::uint64_t> delivered_{0};
};

class MockRig::Impl::MockTrigger final : public TriggerDevice {
 public:
  explicit MockTrigger(Impl* rig) : rig_(rig), clock_(oscillator(rig->options.seed, -2, rig->options.clock_drift_ppm)) {}
  ~MockTrigger() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const TriggerConfiguration& wanted, TriggerConfiguration* actual) noexcept override {
    if (!(wanted.rate_hz > 0)) return DeviceStatus::bad_configuration;
    if (wanted.rate_hz > 200) return DeviceStatus::unsupported;
    rate_ = wanted.rate_hz;
    if (actual != nullptr) *actual = wanted;
    return DeviceStatus::ok;
  }
  DeviceStatus start(Notifier* ready) noexcept override {
    if (!(rate_ > 0)) return DeviceStatus::bad_configuration;
    if (stream.streaming()) return DeviceStatus::ok;
    const DeviceStatus status = stream.start(ready);
    if (status != DeviceStatus::ok) return status;
    try {
      rig_->begin(rate_);
    } catch (const std::exception&) {
      stream.stop();
      return DeviceStatus::failed;
    }
    return status;
  }
  DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override {
    Delivery<Pulse> d;
    const DeviceStatus status = stream.take(limit, &d);
    if (status != DeviceStatus::ok) return status;
    *pulse = d.value;
    pulse->arrival = d.arrival;
    pulses_.fetch_add(1, std::memory_order_relaxed);
    return status;
  }
  void stop() noexcept override {
    stream.stop();
    rig_->halt();
  }
  TriggerStatistics statistics() const noexcept override {
    return {pulses_.load(std::memory_order_relaxed), 0, overruns.load(std::memory_order_relaxed), 1};
  }

  Stream<Pulse, kPulseRing> stream;
  std::atomic<std::uint64_t> overruns{0};
  [[nodiscard]] const DeviceOscillator& clock() const noexcept { return clock_; }

 private:
  Impl* rig_;
  DeviceInfo info_{"mock", "mock-board", "simulated trigger board", "world"};
  DeviceOscillator clock_;
  double rate_ = 0;
  std::atomic<std::uint64_t> pulses_{0};
};

// ---- the producer -------------------------------------------------------------------------------------------------

MockRig::Impl::Impl(std::shared_ptr<const RigTruth> t, const MockRigOptions& o) : truth(std::move(t)), options(o) {
  if (options.blur_samples < 1) throw std::invalid_argument("mock: blur_samples must be 1 or more");
  for (int k = 0; k < truth->mounted().cameras; ++k) cameras.push_back(std::make_unique<MockCamera>(this, k));
  for (const Fault& f : truth->faults())
    if (f.camera >= truth->mounted().cameras)
      throw std::invalid_argument(std::string(to_string(f.kind)) + ": there is no camera " + std::to_string(f.camera) + " on this rig");
  ins = std::make_unique<MockIns>(this);
  trigger = std::make_unique<MockTrigger>(this);
}

void MockRig::Impl::begin(double rate_hz) {
  halt();
  rate_ = rate_hz;
  stop_ = false;
  finished_ = false;
  constexpr Duration kLead = Duration::milliseconds(100);  // the first pictures are rendered before they are due
  if (options.real_time) start_ = monotonic_now() + kLead;
  producer_ = std::thread([this] { produce(); });
  if (options.real_time) deliverer_ = std::thread([this] { hand_out_in_time(); });
}

void MockRig::Impl::halt() noexcept {
  stop_.store(true, std::memory_order_release);
  freed();
  { const std::lock_guard lock(mutex_); }
  posted_.notify_all();
  if (producer_.joinable()) producer_.join();
  if (deliverer_.joinable()) deliverer_.join();
}

HostStamp MockRig::Impl::jittered(HostStamp least, std::uint64_t device, std::uint64_t number) const noexcept {
  if (!options.jitter) return least;
  Random random(mixed(options.seed, number), device);
  const double late = -static_cast<double>(kJitterMean.ns()) * std::log(1 - random.uniform());
  return least + std::min(kJitterMost, Duration::nanoseconds(std::llround(late)));
}

void MockRig::Impl::produce() {
  (void)pthread_setname_np(pthread_self(), "vergence-mock");
  const std::uint64_t count = pulses(rate_);
  const Duration period = Duration::seconds(1 / rate_);
  for (std::uint64_t n = 0; n < count && !stop_.load(std::memory_order_acquire); ++n) {
    make_readings(host_of(n + 4));
    Parcel pulse;
    pulse.device = kTriggerDevice;
    pulse.arrival = jittered(host_of(n) + kReportLatency, 20, n);
    pulse.pulse.value = {n, trigger->clock().read(host_of(n), host_of(n) - start_, truth->faults()), {}};
    post(pulse);
    if (options.real_time) {
      // Not further ahead than two pulses; a pulse that is over before its pictures are begun has none.
      while (monotonic_now() < host_of(n) - period * 2 && !stop_.load(std::memory_order_acquire))
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (monotonic_now() > host_of(n) + period) {
        for (const auto& camera : cameras) camera->lost.fetch_add(1, std::memory_order_relaxed);
        continue;
      }
    }
    make_frames(n);
    // Whatever is made later was measured at the next pulse or after it.
    if (!options.real_time) deliver_until(host_of(n + 1));
  }
  announce_end(host_of(count + 4) + Duration::seconds(11));
  if (!options.real_time)
    deliver_until(HostStamp(INT64_MAX));
  else {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    posted_.notify_all();
  }
}

void MockRig::Impl::make_readings(HostStamp until) {
  if (!ins->stream.streaming()) return;
  for (;; ++readings_) {
    const HostStamp at = start_ + Duration::seconds(static_cast<double>(readings_) / ins->rate);
    if (at >= until) return;
    const Duration time = at - start_;
    InsSample sample = ins->model->sample(readings_, time);
    bool silent = false;
    for (const Fault& f : truth->faults()) silent = silent || (f.kind == FaultKind::ins_gone && f.active(time));
    if (silent) {
      ins->lost.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    Parcel p;
    p.device = kInsDevice;
    p.arrival = jittered(at + kInsLatency, 10, readings_);
    p.reading.value.sample = sample;
    p.reading.value.measured = ins->clock().read(at, time, truth->faults());
    post(p);
  }
}

void MockRig::Impl::make_frames(std::uint64_t pulse) {
  const Duration time = host_of(pulse) - start_;
  for (int k = 0; k < static_cast<int>(cameras.size()); ++k) {
    MockCamera& camera = *cameras[static_cast<std::size_t>(k)];
    bool unplugged = false;
    for (const Fault& f : truth->faults()) unplugged = unplugged || (f.kind == FaultKind::camera_gone && f.concerns(k) && f.active(time));
    if (unplugged != camera.unplugged) {
      Parcel p;
      p.device = k;
      p.arrival = host_of(pulse) + kTransfer;  // after what was under way, before the next frame
      p.frame.what = unplugged ? Delivery<Frame>::What::gone : Delivery<Frame>::What::back;
      post(p);
      camera.unplugged = unplugged;
      camera.counter_base = pulse;
    }
    if (!unplugged && camera.stream.streaming()) make_frame(pulse, k);
  }
}

std::optional<FrameSlot> MockRig::Impl::slot_of(int k) {
  MockCamera& camera = *cameras[static_cast<std::size_t>(k)];
  for (;;) {
    const std::uint32_t seen = freed_.load(std::memory_order_acquire);
    if (stop_.load(std::memory_order_acquire)) return std::nullopt;
    if (const auto slot = camera.pool->acquire()) return slot;
    // Slots that only time will free are not waited for: late frames hold them.
    const bool held_by_delay = on_the_way_[static_cast<std::size_t>(k)].load() > static_cast<int>(kSlots) / 2;
    if (options.real_time || held_by_delay || !camera.stream.streaming()) return std::nullopt;
    freed_.wait(seen, std::memory_order_acquire);
  }
}

void MockRig::Impl::make_frame(std::uint64_t pulse, int k) {
  MockCamera& camera = *cameras[static_cast<std::size_t>(k)];
  const Duration time = host_of(pulse) - start_, exposure = camera.configuration.exposure;
  double brightness = exposure.to_seconds() / kNominalExposure.to_seconds() * std::pow(10.0, camera.configuration.gain_db / 20);
  double delay = 0;
  bool lost = false, twice = false;
  std::uint64_t number = 0;
  for (const Fault& f : truth->faults()) {
    ++number;
    if (!f.active(time) || !f.concerns(k)) continue;
    Random random(mixed(mixed(options.seed, pulse), number), static_cast<std::uint64_t>(k));
    const bool drawn = random.uniform() < f.share;
    if (f.kind == FaultKind::cover || f.kind == FaultKind::night || f.kind == FaultKind::exposure) brightness *= f.factor;
    if (f.kind == FaultKind::lose_frames && drawn) lost = true;
    if (f.kind == FaultKind::late_frames && drawn) delay += f.delay;
    if (f.kind == FaultKind::duplicate_frames && drawn) twice = true;
  }
  if (lost) {
    camera.lost.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const auto slot = slot_of(k);
  if (!slot) {
    camera.underruns.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  std::vector<Transform> way;
  for (int i = 0; i < options.blur_samples; ++i) {
    const double part = (i + 0.5) / options.blur_samples;
    way.push_back(truth->camera_in_enu(k, time + Duration::seconds(part * exposure.to_seconds())).inverse());
  }
  Shot shot;
  shot.exposure = brightness;
  shot.noise_seed =
      options.noise ? static_cast<std::uint32_t>(mixed(options.seed, pulse * kMaxCameras + static_cast<std::uint64_t>(k))) | 1U : 0U;
  camera.renderer->render(way, shot, camera.pool->writable(*slot).data(),
                          static_cast<std::ptrdiff_t>(FramePool::stride(camera.pool->width())));
  Parcel p;
  p.device = k;
  p.arrival = jittered(host_of(pulse) + exposure + kTransfer, static_cast<std::uint64_t>(k), pulse) + Duration::seconds(delay);
  p.frame.value = {*slot,    pulse - camera.counter_base, camera.clock().read(host_of(pulse), time, truth->faults()), {},
                   exposure, FrameStatus::complete};
  on_the_way_[static_cast<std::size_t>(k)].fetch_add(1);
  std::optional<FrameSlot> copy;
  if (twice) copy = camera.pool->acquire();
  if (copy) {
    const auto from = camera.pool->writable(*slot), to = camera.pool->writable(*copy);
    std::memcpy(to.data(), from.data(), from.size());
    Parcel again = p;
    again.frame.value.slot = *copy;
    again.arrival = p.arrival + kTransfer;
    on_the_way_[static_cast<std::size_t>(k)].fetch_add(1);
    post(again);
  }
  post(p);
}

void MockRig::Impl::announce_end(HostStamp at) {
  for (int device = kTriggerDevice; device < static_cast<int>(cameras.size()); ++device) {
    Parcel p;
    p.device = device;
    p.arrival = at;
    p.frame.what = Delivery<Frame>::What::end;
    p.reading.what = Delivery<InsReading>::What::end;
    p.pulse.what = Delivery<Pulse>::What::end;
    post(p);
  }
}

void MockRig::Impl::post(Parcel parcel) {
  const std::lock_guard lock(mutex_);
  parcel.order = orders_++;
  parcels_.push(parcel);
  posted_.notify_all();
}

void MockRig::Impl::deliver_until(HostStamp horizon) {
  for (;;) {
    if (stop_.load(std::memory_order_acquire) || parcels_.empty() || parcels_.top().arrival >= horizon) return;
    const Parcel parcel = parcels_.top();
    parcels_.pop();
    deliver(parcel, parcel.arrival);
  }
}

void MockRig::Impl::hand_out_in_time() {
  (void)pthread_setname_np(pthread_self(), "vergence-mockio");
  std::unique_lock lock(mutex_);
  while (!stop_.load(std::memory_order_acquire)) {
    if (parcels_.empty()) {
      if (finished_) return;
      posted_.wait(lock);
      continue;
    }
    const HostStamp now = monotonic_now();
    const bool end = parcels_.top().frame.what == Delivery<Frame>::What::end;  // after the last delivery nothing is waited for
    if (parcels_.top().arrival > now && !end) {
      (void)posted_.wait_for(lock, std::chrono::nanoseconds((parcels_.top().arrival - now).ns()));
      continue;
    }
    const Parcel parcel = parcels_.top();
    parcels_.pop();
    lock.unlock();
    deliver(parcel, monotonic_now());
    lock.lock();
  }
}

template <class S, class D>
void MockRig::Impl::push_or_wait(S* stream, const D& delivery) {
  for (;;) {
    const std::uint32_t seen = freed_.load(std::memory_order_acquire);
    if (stop_.load(std::memory_order_acquire) || !stream->streaming() || stream->push(delivery)) return;
    if (options.real_time) return;
    freed_.wait(seen, std::memory_order_acquire);
  }
}

void MockRig::Impl::deliver(const Parcel& parcel, HostStamp arrival) {
  if (parcel.device == kTriggerDevice) {
    Delivery<Pulse> d = parcel.pulse;
    d.arrival = arrival;
    // Nobody needs to take the reports; the latest that find no room are counted.
    if (trigger->stream.streaming() && !trigger->stream.push(d)) trigger->overruns.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  if (parcel.device == kInsDevice) {
    Delivery<InsReading> d = parcel.reading;
    d.arrival = arrival;
    if (options.real_time && ins->stream.full()) ins->overruns.fetch_add(1, std::memory_order_relaxed);
    push_or_wait(&ins->stream, d);
    return;
  }
  Delivery<Frame> d = parcel.frame;
  d.arrival = arrival;
  const auto k = static_cast<std::size_t>(parcel.device);
  if (d.what == Delivery<Frame>::What::item) on_the_way_[k].fetch_sub(1);
  push_or_wait(&cameras[k]->stream, d);  // deeper than the slots: frames always find room
}

// ---- the front ----------------------------------------------------------------------------------------------------

MockRig::MockRig(std::shared_ptr<const RigTruth> truth, const MockRigOptions& options)
    : impl_(std::make_unique<Impl>(std::move(truth), options)) {}
MockRig::~MockRig() { impl_->halt(); }

int MockRig::cameras() const noexcept { return static_cast<int>(impl_->cameras.size()); }
CameraDevice& MockRig::camera(int k) noexcept { return *impl_->cameras[static_cast<std::size_t>(k)]; }
InsDevice& MockRig::ins() noexcept { return *impl_->ins; }
TriggerDevice& MockRig::trigger() noexcept { return *impl_->trigger; }
const RigTruth& MockRig::truth() const noexcept { return *impl_->truth; }
std::size_t MockRig::image_bytes() const noexcept {
  std::size_t sum = 0;
  for (const auto& camera : impl_->cameras) sum += camera->bytes();
  return sum;
}
HostStamp MockRig::start() const noexcept { return impl_->started(); }
std::uint64_t MockRig::pulses(double rate_hz) const noexcept { return impl_->pulses(rate_hz); }

}  // namespace vergence::mock
