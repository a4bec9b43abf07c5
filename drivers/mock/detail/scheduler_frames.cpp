#include <array>
#include <cmath>
#include <cstring>
#include <shared_mutex>
#include <thread>
#include <vector>

#include "drivers/mock/detail/scheduler.hpp"

/// The frames of a pulse: which there are, how they are rendered and sent.
namespace vergence::mock {
namespace {

constexpr Duration kNominalExposure = Duration::milliseconds(8);

}  // namespace

void Scheduler::make_frames(std::uint64_t pulse) {
  std::array<Shooting, kMaxCameras> shootings;
  std::size_t count = 0;
  std::array<std::shared_lock<std::shared_mutex>, kMaxCameras> memories;
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    memories[k] = std::shared_lock(cameras_[k]->memory);
  for (int k = 0; k < static_cast<int>(cameras_.size()); ++k) {
    if (!present(pulse, k)) continue;
    if (const auto shooting = plan(pulse, k)) shootings[count++] = *shooting;
  }
  // Each camera renders with its own memory. A thread that lives for one pulse costs a thousandth
  // of a picture.
  const auto render_every_other = [&](std::size_t first) {
    for (std::size_t i = first; i < count; i += 2) render(shootings[i]);
  };
  std::thread beside;
  if (count > 1) beside = std::thread(render_every_other, 1);
  render_every_other(0);
  if (beside.joinable()) beside.join();
  for (std::size_t i = 0; i < count; ++i) send(pulse, shootings[i]);
}

bool Scheduler::present(std::uint64_t pulse, int k) {
  Sender& sender = senders_[static_cast<std::size_t>(k)];
  const bool gone = unplugged_at(plan_.at(pulse).time, k);
  if (gone != sender.unplugged) {
    Parcel p;
    p.device = k;
    p.arrival = host_of(pulse) + kTransfer;  // after what was under way, before the next frame
    p.frame.what = gone ? Delivery<Frame>::What::gone : Delivery<Frame>::What::back;
    queue_.post(p);
    sender.unplugged = gone;
    sender.counter_base = pulse;
  }
  return !gone && pulsed(k) && cameras_[static_cast<std::size_t>(k)]->stream.streaming();
}

std::optional<FrameSlot> Scheduler::slot_of(int k) {
  MockCamera& camera = *cameras_[static_cast<std::size_t>(k)];
  for (;;) {
    const WakeEvent::Ticket seen = rig_.room.ticket();
    if (stopping()) return std::nullopt;
    if (const auto slot = queue_.take_spare(k)) return slot;
    if (const auto slot = camera.pool().acquire()) return slot;
    // Slots that only time will free are not waited for: late frames hold them.
    const bool held_by_delay = queue_.on_the_way(k) > static_cast<int>(MockRig::kSlots) / 2;
    if (rig_.options.real_time || held_by_delay || !camera.stream.streaming()) return std::nullopt;
    rig_.room.wait(seen);
  }
}

std::optional<Scheduler::Shooting> Scheduler::plan(std::uint64_t pulse, int k) {
  MockCamera& camera = *cameras_[static_cast<std::size_t>(k)];
  Shooting s;
  s.camera = k;
  s.exposure = exposure_of(*rig_.truth, rig_.options.seed, pulse_at(pulse, k), k);
  if (s.exposure.missed) {
    ++senders_[static_cast<std::size_t>(k)].counter_base;
    return std::nullopt;
  }
  if (s.exposure.lost) {
    camera.lost.fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
  }
  const auto slot = slot_of(k);
  if (!slot) {
    camera.underruns.fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
  }
  s.slot = *slot;
  s.setting = camera.setting_at(pulse);
  return s;
}

void Scheduler::send(std::uint64_t pulse, const Shooting& shooting) {
  const auto k = static_cast<std::size_t>(shooting.camera);
  MockCamera& camera = *cameras_[k];
  Sender& sender = senders_[k];
  const Duration open = shooting.setting.exposure;
  const HostStamp begins = host_of(pulse) + camera.trigger_delay();
  Parcel p;
  p.device = shooting.camera;
  p.generation = camera.generation();
  p.arrival = jittered(begins + open + kTransfer, k, pulse) + shooting.exposure.delay;
  p.frame.value = {shooting.slot,
                   pulse - sender.counter_base,
                   camera.clock().read(begins, plan_.at(pulse).time, rig_.truth->faults()),
                   {},
                   open,
                   FrameStatus::complete,
                   shooting.setting.gain_db};
  camera.label(shooting.slot, pulse);
  std::optional<FrameSlot> copy;
  if (shooting.exposure.twice) copy = camera.pool().acquire();
  if (copy) {
    camera.label(*copy, pulse);
    const auto from = camera.pool().writable(shooting.slot), to = camera.pool().writable(*copy);
    std::memcpy(to.data(), from.data(), from.size());
    Parcel again = p;
    again.frame.value.slot = *copy;
    again.arrival = p.arrival + kTransfer;
    queue_.post(again);
  }
  queue_.post(p);
}

void Scheduler::render(const Shooting& shooting) {
  const Exposure& exposure = shooting.exposure;
  MockCamera& sender = *cameras_[static_cast<std::size_t>(shooting.camera)];
  const ExposureSetting& c = shooting.setting;
  std::vector<Transform> way, bus;
  for (int i = 0; i < rig_.options.blur_samples; ++i) {
    const Duration at = exposure.time + Duration::seconds((i + 0.5) / rig_.options.blur_samples *
                                                          c.exposure.to_seconds());
    way.push_back(rig_.truth->camera_in_enu(exposure.camera, at).inverse());
    if (const auto T_enu_bus = rig_.truth->bus_in_enu(at)) bus.push_back(way.back() * *T_enu_bus);
  }
  if (bus.size() != way.size()) bus.clear();  // it comes or goes amid the exposure
  Shot shot;
  shot.exposure = exposure.brightness * c.exposure.to_seconds() / kNominalExposure.to_seconds() *
                  std::pow(10.0, c.gain_db / 20);
  if (rig_.options.noise) {
    const std::uint64_t picture =
        exposure.pulse * kMaxCameras + static_cast<std::uint64_t>(exposure.camera);
    shot.noise_seed = static_cast<std::uint32_t>(mixed(rig_.options.seed, picture)) | 1U;
  }
  // Through the lens of the camera that sees it, into the memory of the one that sends it.
  cameras_[static_cast<std::size_t>(exposure.camera)]->take(
      way, bus, shot, sender.pool().writable(shooting.slot).data());
}

}  // namespace vergence::mock
