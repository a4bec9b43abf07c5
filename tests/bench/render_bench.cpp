// What a rendered stereo pair costs on one core, along the loop drive: mean and worst, noise and
// distortion on.
//
//   render_bench [WIDTH]…        default 640 1024 1280; height is three quarters of it
//
// CPU time of the calling thread, so that a busy machine does not count.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "drivers/mock/world/drive.hpp"
#include "drivers/mock/world/renderer.hpp"

namespace {

using namespace vergence;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

Camera camera_of(int width) {
  Intrinsics k;
  k.width = width;
  k.height = width * 3 / 4;
  k.fx = k.fy = 0.866 * width;  // 60° by 45°
  k.cx = 0.5 * (k.width - 1);
  k.cy = 0.5 * (k.height - 1);
  k.distortion = {-0.2, 0.05, 0.0003, -0.0002, 0};
  return Camera(k);
}

void measure(const std::shared_ptr<const mock::World>& world, int width) {
  const mock::Drive drive(mock::DriveOptions{}, *world);
  const Camera camera = camera_of(width);
  mock::Renderer left(world, camera), right(world, camera);
  const Transform T_right_left{Mat3::Identity(), Vec3(-0.75, 0, 0)};
  std::vector<std::uint8_t> image(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(width) * 3 / 4);
  std::vector<double> times;
  mock::Shot shot;
  for (Duration t{}; t < drive.duration(); t = t + Duration::milliseconds(1500)) {
    const double start = cpu_ms();
    const Transform T_left_enu = mock::camera_pose(drive.at(t), mock::default_T_body_left());
    ++shot.noise_seed;
    left.render(T_left_enu, shot, image.data(), width);
    ++shot.noise_seed;
    right.render(T_right_left * T_left_enu, shot, image.data(), width);
    times.push_back(cpu_ms() - start);
  }
  std::sort(times.begin(), times.end());
  double sum = 0;
  for (const double v : times) sum += v;
  std::printf("%4d x %4d  mean %6.1f  median %6.1f  worst %6.1f ms a pair\n", width, width * 3 / 4,
              sum / static_cast<double>(times.size()), times[times.size() / 2], times.back());
}

}  // namespace

int main(int argc, char** argv) {
  const double start = cpu_ms();
  const auto world = std::make_shared<const mock::World>(mock::WorldOptions{});
  std::printf("world built in %.0f ms\n", cpu_ms() - start);
  std::vector<int> widths;
  for (int i = 1; i < argc; ++i) widths.push_back(std::clamp(std::atoi(argv[i]), 16, 8192));
  if (widths.empty()) widths = {640, 1024, 1280};
  for (const int width : widths) measure(world, width);
}
