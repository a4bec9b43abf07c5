#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "tests/unit/drivers/sync/pulse_rig.hpp"

/// What the time layer reaches, in virtual time: pairs and acquisition. sync_bench [SEEDS]
namespace {

using vergence::Duration;
using vergence::SyncCounters;
using vergence::SyncMode;
using vergence::SyncOptions;
using vergence::testing::PulseRig;
using vergence::testing::PulseRigOptions;

SyncOptions board() {
  SyncOptions o;
  o.mode = SyncMode::board;
  return o;
}

void acquisition(double rate, double vary_ms, const char* name, int seeds) {
  double worst = 0, mean = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    PulseRigOptions o;
    o.seed = static_cast<std::uint64_t>(seed);
    o.rate_hz = rate;
    o.vary = Duration::seconds(vary_ms * 1e-3);
    o.gone = {{1, 8, 10}};
    o.reboots = {15};
    PulseRig rig(o, board());
    rig.run(20);
    worst = std::max(worst, rig.truth().worst_acquisition_s);
    mean += rig.truth().worst_acquisition_s / seeds;
  }
  std::printf(
      "acquisition, %2.0f Hz, %-26s worst of start, reconnect, reboot: mean %.2f s, worst %.2f s\n",
      rate, name, mean, worst);
}

void ten_hours(std::uint64_t seed) {
  PulseRigOptions o;
  o.seed = seed;
  o.lost = 1e-3;
  o.missed = 5e-4;
  o.gone = {
      {0, 1000, 1003}, {1, 7000, 7010}, {1, 14000, 14001}, {0, 21000, 21005}, {1, 30000, 30002}};
  o.reboots = {5000, 16000, 27000};
  const auto begin = std::chrono::steady_clock::now();
  PulseRig rig(o, board());
  rig.run(36'000);
  const double took =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const auto& t = rig.truth();
  const SyncCounters c = rig.counters();
  const auto n = [](std::uint64_t v) { return static_cast<unsigned long long>(v); };
  std::printf(
      "ten hours, seed %llu: %llu pulses, %llu sets, %llu complete, %llu wrong, %llu in doubt; "
      "%.1f s\n",
      n(seed), n(t.pulses), n(t.sets), n(t.complete), n(t.wrong), n(t.unproven), took);
  for (std::size_t k = 0; k < 2; ++k)
    std::printf(
        "  camera %zu: lost %llu of %llu, missed triggers %llu of %llu, late %llu, acquisitions "
        "%llu, frames given back %llu\n",
        k, n(c.lost[k]), n(t.lost[k]), n(c.missed_trigger[k]), n(t.missed[k]), n(c.late[k]),
        n(c.acquisitions[k]), n(c.acquiring[k]));
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  for (const double rate : {20.0, 30.0}) {
    acquisition(rate, 1, "intervals varied by 1 ms", seeds);
    acquisition(rate, 0, "even intervals, a pause", seeds);
  }
  for (int seed = 1; seed <= std::max(1, seeds / 10); ++seed)
    ten_hours(static_cast<std::uint64_t>(seed));
  return 0;
}
