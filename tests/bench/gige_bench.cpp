/// Two simulated GigE cameras, 1280 × 960 at 30 Hz, over the loopback into the driver: what
/// arrives, when, and what it costs.
///
///   gige_bench [--seconds 60] [--starts 20] [--packet 9000]
/// CPU time is that of every thread but the simulators' own; the latency from the last sendto() of
/// a frame to wait()'s return.
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/gige/gige.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/gvsp_sender.hpp"

namespace {

using namespace vergence;

constexpr int kCameras = 2, kWidth = 1280, kHeight = 960;
constexpr double kRate = 30;

/// Seconds on a processor of all threads that are not the simulators'.
double cpu_seconds() {
  double sum = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::ifstream(task.path() / "comm") >> name;
    double ns = 0;
    std::ifstream(task.path() / "schedstat") >> ns;
    if (!name.starts_with("simulator")) sum += ns * 1e-9;
  }
  return sum;
}

std::uint64_t number_of(const ImageView& image) {
  std::uint64_t n = 0;
  for (int i = 7; i >= 0; --i) n = n << 8U | image.at(i, 0);
  return n;
}

struct Rig {
  std::vector<std::unique_ptr<test::GigeCamera>> simulators;
  std::vector<std::unique_ptr<CameraDevice>> cameras;
};

Rig make_rig(int packet) {
  Rig rig;
  for (int k = 0; k < kCameras; ++k) {
    test::GigeCameraOptions o;
    o.address = test::GigeCamera::address(k);
    o.serial = "BENCH-" + std::to_string(k);
    o.discoverable = false;
    o.largest_packet = 65'000;
    rig.simulators.push_back(std::make_unique<test::GigeCamera>(o));
    DeviceStatus status = DeviceStatus::ok;
    auto camera = gige::make_driver()->open(o.address, &status);
    CameraConfiguration c{
        kWidth, kHeight, kRate, Duration::milliseconds(5), 0, CameraTrigger::free};
    test::give<gige::Options>(&c, "packet_size", std::to_string(packet));
    c.sharing = kCameras;
    if (camera == nullptr || camera->configure(c, nullptr) != DeviceStatus::ok) {
      std::fprintf(stderr, "camera %d: %s\n", k,
                   camera == nullptr ? "not opened" : camera->last_error().c_str());
      std::exit(2);
    }
    if (!camera->remark().empty()) std::printf("camera %d: %s\n", k, camera->remark().c_str());
    rig.cameras.push_back(std::move(camera));
  }
  return rig;
}

struct Taken {
  std::uint64_t frames = 0, complete = 0;
  std::vector<double> latency_ms;
};

/// Takes what comes until the camera is stopped.
Taken consume(CameraDevice* camera, const test::GigeCamera* simulator) {
  Taken taken;
  taken.latency_ms.reserve(10'000);
  for (Frame frame;;) {
    const DeviceStatus status = camera->wait(Duration::milliseconds(500), &frame);
    if (status == DeviceStatus::stopped || status == DeviceStatus::gone) return taken;
    if (status != DeviceStatus::ok) continue;
    const HostStamp now = monotonic_now();
    ++taken.frames;
    if (frame.status == FrameStatus::complete) {
      ++taken.complete;
      const HostStamp sent = simulator->sent(number_of(camera->view(frame.slot)));
      if (sent.ns() > 0) taken.latency_ms.push_back(std::max(0.0, (now - sent).to_seconds() * 1e3));
    }
    camera->release(frame.slot);
  }
}

/// One start, so many seconds, one stop. → frames that the cameras exposed and that did not arrive
/// whole
std::uint64_t run(Rig* rig, double seconds, std::vector<Taken>* all, double* cpu) {
  std::vector<std::uint64_t> before;
  for (const auto& s : rig->simulators) before.push_back(s->report().exposed);
  const double cpu_before = cpu_seconds();
  for (const auto& c : rig->cameras)
    if (c->start(nullptr) != DeviceStatus::ok) {
      std::fprintf(stderr, "not started: %s\n", c->last_error().c_str());
      std::exit(2);
    }
  all->assign(kCameras, {});
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < kCameras; ++k)
    threads.emplace_back(
        [rig, all, k] { (*all)[k] = consume(rig->cameras[k].get(), rig->simulators[k].get()); });
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  for (const auto& s : rig->simulators)
    s->silence(true);  // so that nothing is on its way at the end
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  *cpu = cpu_seconds() - cpu_before;
  for (const auto& c : rig->cameras) c->stop();
  for (std::thread& t : threads) t.join();
  std::uint64_t missing = 0;
  for (std::size_t k = 0; k < kCameras; ++k) {
    missing += rig->simulators[k]->report().exposed - before[k] - (*all)[k].complete;
    rig->simulators[k]->silence(false);
  }
  return missing;
}

double at(std::vector<double>* sorted, double share) {
  if (sorted->empty()) return -1;
  std::sort(sorted->begin(), sorted->end());
  return (*sorted)[std::min(sorted->size() - 1,
                            static_cast<std::size_t>(share * static_cast<double>(sorted->size())))];
}

}  // namespace

int main(int argc, char** argv) {
  double seconds = 60;
  int starts = 20, packet = 9000;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--seconds") == 0) seconds = std::atof(argv[i + 1]);
    if (std::strcmp(argv[i], "--starts") == 0) starts = std::atoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--packet") == 0) packet = std::atoi(argv[i + 1]);
  }
  Rig rig = make_rig(packet);
  std::vector<Taken> all;
  double cpu = 0;

  int clean = 0;
  for (int i = 0; i < starts; ++i) clean += run(&rig, 0.5, &all, &cpu) == 0 ? 1 : 0;
  std::printf("starts without a lost frame: %d of %d\n", clean, starts);

  const std::uint64_t missing = run(&rig, seconds, &all, &cpu);
  for (std::size_t k = 0; k < kCameras; ++k) {
    Taken& t = all[k];
    std::printf(
        "camera %zu: %llu frames of %llu exposed; sendto to hand: median %.2f ms, p99 %.2f, most "
        "%.2f\n",
        k, static_cast<unsigned long long>(t.complete),
        static_cast<unsigned long long>(rig.simulators[k]->report().exposed),
        at(&t.latency_ms, 0.5), at(&t.latency_ms, 0.99), at(&t.latency_ms, 1));
  }
  std::printf("%.0f s at %d-byte packets: %llu frames lost; %.2f %% of one core for both cameras\n",
              seconds, packet, static_cast<unsigned long long>(missing),
              100 * cpu / (seconds + 0.2));
  return 0;
}
