#pragma once
#include <algorithm>
#include <queue>
#include <utility>
#include <vector>

#include "core/math/random.hpp"
#include "drivers/sync/rig_synchronizer.hpp"
#include "firmware_iface/trigger/trigger.h"

/// A rig in virtual time that knows which pulse made which frame: board, cameras, their clocks,
/// counters and transports; no images.
namespace vergence::testing {

struct PulseRigOptions {
  double rate_hz = 30;
  Duration vary = Duration::milliseconds(1);
  int cameras = 2;
  std::uint64_t seed = 1;
  // Probabilities per frame or pulse.
  double lost = 0, missed = 0, unreported = 0, duplicated = 0;
  // Probability per pulse that the board's line stalls for 60 ms.
  double bursts = 0;
  Duration report_delay = Duration::milliseconds(3), frame_delay = Duration::milliseconds(25);
  // Means of exponential jitter.
  double report_jitter_ms = 1, frame_jitter_ms = 2;
  // Uniform noise of the cameras' stamps in either direction.
  double stamp_noise_us = 3;
  // Additional constant delay of the transport.
  std::array<Duration, kMaxCameras> lag{};
  // Each camera's buffer holds an old image at its start.
  bool stale_first = false;
  // Each camera ignores its first trigger.
  bool first_dropped = false;
  // First value of a camera's counter.
  std::uint64_t counter_start = 0;
  Duration exposure = Duration::milliseconds(8);
  std::array<Duration, kMaxCameras> delay{
      Duration::microseconds(40), Duration::microseconds(70), {}, {}};
  // Noise of the pulses' mapped edges.
  Duration host_noise = Duration::microseconds(20);
  // Events, seconds since the start.
  struct Outage {
    int camera = 0;
    double from = 0, until = 0;
  };
  std::vector<Outage> outages{};
  // Times at which the board restarts; there are no pulses for 0.7 s.
  std::vector<double> reboots{};
  struct Jump {
    int camera = 0;
    double at = 0, seconds = 0;
  };
  // Times at which a camera's clock is set.
  std::vector<Jump> jumps{};
  // Time around events, in s, without losses: losses of a disconnected camera are unknown.
  double quiet = 4;
};

/// Actions of the rig by name.
struct PulseRigTruth {
  std::uint64_t pulses = 0;
  std::array<std::uint64_t, kMaxCameras> exposed{}, lost{}, missed{}, duplicated{};
  std::uint64_t sets = 0, complete = 0, wrong = 0, ambiguous = 0, unreported = 0;
  // Number of contract violations: a slot returned twice or never, a wrong order or flag.
  std::uint64_t broken = 0;
  // Number of stamps farther from the truth than their bound.
  std::uint64_t outside = 0;
  // Time from the first pulse after a start, reconnect or reboot to the first verified set.
  double worst_acquisition_s = 0;
};

class PulseRig {
 public:
  PulseRig(const PulseRigOptions& options, SyncOptions sync)
      : o_(options), sync_(with(options, sync)), random_(options.seed, 77), truths_(1U << 16U) {
    board_offset_ = static_cast<std::int64_t>(random_.below(1'000'000)) * 1'000;
    board_drift_ = random_.uniform(-50e-6, 50e-6);
    for (int k = 0; k < o_.cameras; ++k) start_camera(k);
  }

  void run(double seconds) {
    const double period = 1 / o_.rate_hz;
    double t = kStart;
    for (std::size_t next_reboot = 0; t - kStart < seconds;) {
      if (next_reboot < o_.reboots.size() && t - kStart >= o_.reboots[next_reboot]) {
        ++next_reboot;
        ++boot_;
        number_ = 0;
        resumed_ = true;
        board_offset_ = -ns(t) + static_cast<std::int64_t>(random_.below(1'000'000)) * 1'000;
        t += 0.7;
        waiting_since_.fill(t);
      }
      device_events(t);
      make_pulse(t);
      deliver(ns(t));
      if (const std::uint32_t leave_out = sync_.wants_pause(); leave_out > 0 && pauses_) {
        ++asked_;
        for (std::uint32_t i = 0; i < leave_out; ++i) t += interval(period);
        resumed_ = true;
      }
      t += interval(period);
    }
    deliver(INT64_MAX);
    sync_.finish();
    drain();
    truth_.broken += static_cast<std::uint64_t>(
        std::count_if(held_.begin(), held_.end(), [](std::uint8_t n) { return n != 0; }));
  }

  void pauses(bool possible) { pauses_ = possible; }
  [[nodiscard]] const PulseRigTruth& truth() const { return truth_; }
  [[nodiscard]] SyncCounters counters() const { return sync_.counters(); }
  [[nodiscard]] int asked() const { return asked_; }

 private:
  // Start in s of the host's clock.
  static constexpr double kStart = 1000;
  struct Camera {
    std::int64_t offset = 0;
    double drift = 0;
    std::uint64_t counter = 0;
    bool here = true, first = true;
    std::int64_t last_arrival = 0;
  };
  struct Event {
    std::int64_t arrival = 0;
    std::uint64_t order = 0;
    bool is_pulse = false;
    Pulse pulse{};
    SyncFrame frame{};
    [[nodiscard]] bool operator<(const Event& o) const {
      return arrival != o.arrival ? arrival > o.arrival : order > o.order;
    }
  };
  struct Made {
    std::uint64_t pulse = 0;
    std::int64_t middle = 0;
  };

  static std::int64_t ns(double s) { return std::llround(s * 1e9); }
  static SyncOptions with(const PulseRigOptions& o, SyncOptions s) {
    s.cameras = o.cameras;
    s.interval = Duration::seconds(1 / o.rate_hz);
    for (std::size_t k = 0; k < kMaxCameras; ++k) s.camera[k].delay = o.delay[k];
    return s;
  }
  [[nodiscard]] DeviceStamp board_time(std::int64_t host) const {
    return DeviceStamp((host + board_offset_ +
                        std::llround(board_drift_ * static_cast<double>(host - ns(kStart)))) /
                       1'000 * 1'000);
  }
  double interval(double period) {
    const double sign = trigger_interval_is_longer(static_cast<std::uint32_t>(number_)) ? 1 : -1;
    ++number_;
    return period + sign * o_.vary.to_seconds();
  }
  double exponential(double mean) { return -mean * std::log(1 - random_.uniform()); }
  bool quiet(double t) const {
    const double s = t - kStart;
    if (s < o_.quiet) return true;
    for (const auto& g : o_.outages)
      if (s > g.from - o_.quiet && s < g.until + o_.quiet) return true;
    return std::any_of(o_.reboots.begin(), o_.reboots.end(),
                       [&](double r) { return std::abs(s - r) < o_.quiet; });
  }
  /// Its clock is set about now. A clock that goes back by as many pulses as are missed at that
  /// moment nobody could tell.
  bool being_set(int k, std::int64_t at) const {
    const double s = static_cast<double>(at) * 1e-9 - kStart;
    return std::any_of(o_.jumps.begin(), o_.jumps.end(),
                       [&](const auto& j) { return j.camera == k && std::abs(s - j.at) < 0.5; });
  }
  void start_camera(int k) {
    Camera& c = cameras_[static_cast<std::size_t>(k)];
    c.offset = static_cast<std::int64_t>(random_.below(2'000'000'000)) * 1'000 - 1'000'000'000'000;
    c.drift = random_.uniform(-50e-6, 50e-6);
    c.counter = o_.counter_start;
    c.here = c.first = true;
    waiting_since_[static_cast<std::size_t>(k)] = 0;
  }
  DeviceStamp stamp(const Camera& c, std::int64_t host) {
    const double noise = random_.uniform(-o_.stamp_noise_us, o_.stamp_noise_us) * 1e3;
    const std::int64_t exact =
        host + c.offset + std::llround(c.drift * static_cast<double>(host - ns(kStart)) + noise);
    return DeviceStamp(exact / 1'000 * 1'000);
  }

  void device_events(double t) {
    const double s = t - kStart;
    for (const auto& g : o_.outages) {
      Camera& c = cameras_[static_cast<std::size_t>(g.camera)];
      if (c.here && s >= g.from && s < g.until) {
        deliver(ns(t));
        c.here = false;
        sync_.absent(g.camera);
        drain();
      } else if (!c.here && s >= g.until && s < g.until + 1) {
        start_camera(g.camera);
        waiting_since_[static_cast<std::size_t>(g.camera)] = t;
        sync_.restarted(g.camera);
        drain();
      }
    }
    for (const auto& j : o_.jumps)
      if (s >= j.at && last_s_ < j.at)
        cameras_[static_cast<std::size_t>(j.camera)].offset += ns(j.seconds);
    last_s_ = s;
  }

  void make_pulse(double t) {
    const std::int64_t at = ns(t);
    ++truth_.pulses;
    for (double& since : waiting_since_) since = since == 0 ? t : since;
    const bool calm = quiet(t), resumed = std::exchange(resumed_, false);
    if (calm || random_.uniform() >= o_.unreported) {
      Event e{.is_pulse = true};
      Pulse& p = e.pulse;
      p.number = number_;
      p.boot = boot_;
      p.resumed = resumed;
      p.edge = board_time(at);
      p.mapped = true;
      p.host = HostStamp(
          at + std::llround(random_.uniform(-1, 1) * static_cast<double>(o_.host_noise.ns())));
      p.host_error = o_.host_noise + Duration::microseconds(1);
      if (random_.uniform() < o_.bursts) stalled_until_ = at + 60'000'000;
      const std::int64_t delayed =
          at + o_.report_delay.ns() + ns(exponential(o_.report_jitter_ms * 1e-3));
      last_report_ = std::max({delayed, stalled_until_, last_report_ + 1});
      p.arrival = HostStamp(last_report_);
      put(e, last_report_);
      if (random_.uniform() < o_.duplicated) put(e, last_report_ + 1);
    }
    for (int k = 0; k < o_.cameras; ++k) expose(k, at, calm);
  }

  void expose(int k, std::int64_t at, bool calm) {
    const auto i = static_cast<std::size_t>(k);
    Camera& c = cameras_[i];
    if (!c.here) return;
    const std::int64_t start = at + o_.delay[i].ns();
    if (c.first) {
      c.first = false;
      if (o_.stale_first)
        frame(k, c.counter++, at - ns(random_.uniform(0.01, 0.5)), start, UINT64_MAX);
      if (o_.first_dropped) return;
    }
    if (!calm && !being_set(k, at) && random_.uniform() < o_.missed) {
      ++truth_.missed[i];
      return;
    }
    ++truth_.exposed[i];
    const std::uint64_t counter = c.counter++;
    if (!calm && random_.uniform() < o_.lost) {
      ++truth_.lost[i];
      return;
    }
    frame(k, counter, start, start, truth_.pulses);
  }

  void frame(int k, std::uint64_t counter, std::int64_t start, std::int64_t sent,
             std::uint64_t pulse) {
    const auto i = static_cast<std::size_t>(k);
    Camera& c = cameras_[i];
    Event e;
    SyncFrame& f = e.frame;
    f.camera = k;
    f.slot = static_cast<FrameSlot>(made_ % truths_.size());
    truths_[made_++ % truths_.size()] = {pulse, start + o_.exposure.ns() / 2};
    f.counter = counter;
    f.exposure_start = stamp(c, start);
    f.exposure = o_.exposure;
    f.middle = {HostStamp(start + o_.exposure.ns() / 2), Duration::milliseconds(1)};
    const std::int64_t delayed = sent + (o_.exposure + o_.frame_delay + o_.lag[i]).ns() +
                                 ns(exponential(o_.frame_jitter_ms * 1e-3));
    c.last_arrival = std::max(delayed, c.last_arrival + 1);
    f.arrival = HostStamp(c.last_arrival);
    put(e, c.last_arrival);
    if (pulse != UINT64_MAX && random_.uniform() < o_.duplicated) {
      put(e, c.last_arrival + 1);
      ++truth_.duplicated[i];
    }
  }

  void put(Event e, std::int64_t arrival) {
    e.arrival = arrival;
    e.order = ++order_;
    events_.push(e);
  }
  void deliver(std::int64_t until) {
    while (!events_.empty() && events_.top().arrival <= until) {
      const Event e = events_.top();
      events_.pop();
      if (e.is_pulse) {
        sync_.pulse(e.pulse);
      } else {
        if (!cameras_[static_cast<std::size_t>(e.frame.camera)].here) continue;
        offer(e.frame);
      }
      drain();
    }
  }

  /// Contract of the synchroniser: a slot that is accepted comes out once.
  void offer(const SyncFrame& frame) {
    const SyncResult verdict = sync_.offer(frame);
    std::uint8_t& held = held_[static_cast<std::size_t>(frame.slot)];
    if (verdict == SyncResult::accepted) truth_.broken += held++ == 0 ? 0 : 1;
  }
  void check_contract(const SyncedSet& set) {
    bool complete = true;
    for (std::size_t k = 0; k < kMaxCameras; ++k) {
      if (set.present[k])
        truth_.broken += held_[static_cast<std::size_t>(set.slots[k])]-- == 1 ? 0 : 1;
      complete = complete && (set.present[k] || k >= static_cast<std::size_t>(o_.cameras));
    }
    truth_.broken += complete == set.complete ? 0 : 1;
    truth_.broken += truth_.sets > 0 && set.number <= last_number_ ? 1 : 0;
    last_number_ = set.number;
  }
  void drain() {
    for (SyncedSet set; sync_.next(&set);) {
      check_contract(set);
      ++truth_.sets;
      truth_.complete += set.complete ? 1 : 0;
      truth_.unreported += set.reported ? 0 : 1;
      if (set.proof != SyncProof::numbered) {
        ++truth_.ambiguous;
        continue;
      }
      std::size_t base = 0;
      while (!set.present[base]) ++base;
      const Made first = truths_[static_cast<std::size_t>(set.slots[base])];
      bool right = true;
      for (std::size_t k = 0; k < kMaxCameras; ++k) {
        if (!set.present[k]) continue;
        right = right && truths_[static_cast<std::size_t>(set.slots[k])].pulse == first.pulse;
        if (waiting_since_[k] > 0) {
          const double since = static_cast<double>(first.middle) * 1e-9 - waiting_since_[k];
          if (since > 0) truth_.worst_acquisition_s = std::max(truth_.worst_acquisition_s, since);
        }
        waiting_since_[k] = -1;
      }
      const std::int64_t off = std::abs(set.stamp.ns() - first.middle);
      truth_.outside += off <= set.error.ns() ? 0 : 1;
      // Report of another pulse than the frames': a stamp that is nearer to its neighbour.
      truth_.wrong += right && static_cast<double>(off) * 1e-9 * o_.rate_hz < 0.4 ? 0 : 1;
    }
  }

  PulseRigOptions o_;
  RigSynchronizer sync_;
  Random random_;
  std::vector<Made> truths_;
  std::vector<std::uint8_t> held_ = std::vector<std::uint8_t>(1U << 16U, 0);
  std::uint64_t last_number_ = 0;
  std::uint64_t made_ = 0;
  std::array<Camera, kMaxCameras> cameras_{};
  // 0 waits for the next pulse, -1 waits for nothing.
  std::array<double, kMaxCameras> waiting_since_{};
  std::priority_queue<Event> events_;
  std::int64_t board_offset_ = 0, last_report_ = 0, stalled_until_ = 0;
  double board_drift_ = 0, last_s_ = -1;
  std::uint64_t number_ = 0, order_ = 0;
  std::uint32_t boot_ = 7;
  bool resumed_ = true, pauses_ = true;
  int asked_ = 0;
  PulseRigTruth truth_{};
};

}  // namespace vergence::testing
