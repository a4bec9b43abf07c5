// Stamps of an XSens INS over a serial line, in virtual time: |mapped − true| of every sample after
// 20 s of an 80 s drive, over several clocks and seeds, and how long a reading is under way. One
// line a case; `ins_bench [seeds]`.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "drivers/mock/simulators/simulators.hpp"
#include "drivers/xsens/device.hpp"
#include "tests/support/xsens_terminal.hpp"

namespace {

using namespace vergence;

struct Case {
  xbus::Generation generation;
  double rate;
  std::uint32_t baud;
  int latency_ms;  // 0: no converter
};

struct Errors {
  std::vector<double> stamp_ms, delay_ms;
};

bool run(const Case& c, std::uint64_t seed, Errors* errors) {
  constexpr Duration kSettled = Duration::seconds(20);
  mock::XsensSimulatorOptions sensor;
  sensor.generation = c.generation;
  sensor.baud = c.baud;
  sensor.seed = seed;
  sensor.clock_ppm = seed % 2 == 0 ? -50 : 50;
  sensor.duration = Duration::seconds(80);
  mock::SimulatedLineOptions line;
  line.converter = c.latency_ms > 0;
  line.latency_timer = Duration::milliseconds(c.latency_ms);
  line.converter_clock_ppm = seed % 4 < 2 ? 20 : -20;
  line.seed = seed;
  auto simulator = std::make_shared<mock::XsensSimulator>(test::resting_sample, sensor);
  xsens::Options options;
  options.baud = c.baud;
  xsens::Device device(std::make_unique<mock::SimulatedPlace>(simulator, line), options);
  if (device.configure(c.rate, nullptr) != DeviceStatus::ok ||
      device.start(nullptr) != DeviceStatus::ok) {
    std::printf("%s\n", device.last_error().c_str());
    return false;
  }
  std::vector<InsReading> all;
  InsReading r;
  while (device.wait(Duration::seconds(60), &r) == DeviceStatus::ok) all.push_back(r);
  if (all.empty()) return false;
  // The newest sample read is the newest the simulator sent.
  const std::int64_t origin = c.generation == xbus::Generation::mark4
                                  ? simulator->sample_time_origin_ns()
                                  : all.back().measured.ns() - simulator->sample_times_ns().back();
  for (const InsReading& one : all) {
    if (one.measured - all.front().measured < kSettled) continue;
    const HostStamp truth = simulator->host_time(one.measured.ns() - origin);
    errors->stamp_ms.push_back(std::abs((one.host - truth).to_seconds()) * 1e3);
    errors->delay_ms.push_back((one.arrival - truth).to_seconds() * 1e3);
  }
  return true;
}

double at(std::vector<double>& values, double p) {
  std::sort(values.begin(), values.end());
  return values.empty()
             ? -1
             : values[std::min(values.size() - 1,
                               static_cast<std::size_t>(p * static_cast<double>(values.size())))];
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 8;
  std::printf("%-28s %-8s | %-30s | %s\n", "line", "timer", "stamp error, ms: p50 p99 worst",
              "under way, ms: p50 p99");
  using xbus::Generation;
  for (const Case& c :
       {Case{Generation::legacy, 120, 115200, 16}, Case{Generation::legacy, 120, 115200, 1},
        Case{Generation::mark4, 100, 115200, 16}, Case{Generation::mark4, 100, 115200, 4},
        Case{Generation::mark4, 100, 115200, 1}, Case{Generation::mark4, 100, 115200, 0},
        Case{Generation::legacy, 120, 460800, 16}, Case{Generation::legacy, 120, 460800, 1},
        Case{Generation::mark4, 100, 921600, 16}, Case{Generation::mark4, 100, 921600, 1},
        Case{Generation::mark4, 400, 921600, 16}, Case{Generation::mark4, 400, 921600, 1}}) {
    Errors errors;
    for (int seed = 1; seed <= seeds; ++seed)
      if (!run(c, static_cast<std::uint64_t>(seed), &errors)) return 1;
    char name[64], timer[16];
    std::snprintf(name, sizeof name, "%s %.0f Hz, %u baud",
                  c.generation == Generation::legacy ? "MTi-G" : "MTi-G-710", c.rate, c.baud);
    std::snprintf(timer, sizeof timer, c.latency_ms > 0 ? "%d ms" : "no chip", c.latency_ms);
    std::printf("%-28s %-8s | %8.3f %8.3f %8.3f     | %6.1f %6.1f\n", name, timer,
                at(errors.stamp_ms, 0.5), at(errors.stamp_ms, 0.99), at(errors.stamp_ms, 1),
                at(errors.delay_ms, 0.5), at(errors.delay_ms, 0.99));
  }
  return 0;
}
